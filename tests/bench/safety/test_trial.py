"""Laws of the trial's state machine, each edge of time and window on both sides of its float.

States are compared by astuple(): from Python 3.13 on a dataclass that holds NaN differs from itself.
"""

import math
from dataclasses import astuple, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.bench.safety.permit import CLOCK_RESOLUTION, Trip
from slipbench.bench.safety.trial import (
    ENDED,
    HOLDING,
    NO_OFFSETS,
    Offsets,
    Plan,
    TrialState,
    advance,
    controller_active,
    not_ready,
    plan_of,
    requested_command,
    tripped,
    waveform_value,
)
from slipbench.bench.trials.excitation import Excitation
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, Phase, TripReason
from slipbench.protocol.configuration import parse
from slipbench.protocol.controller_file import ControllerFile
from tests.bench.conditions import trial_file
from tests.bench.safety.sights import (
    GEAR,
    GRIP,
    LIMITS,
    OPENING,
    above,
    below,
    changed,
    vehicle_state,
)

NAN = math.nan
RELEASED = vehicle_state(Authority.NONE, rider__button=False)
PRESSED = vehicle_state(Authority.NONE)
TABLE = (0.0, 0.03125, 0.0625, -0.03125)
TRIP = Trip(TripReason.BRAKE, "brake")


def plan(actuator="throttle", table=TABLE, **limits) -> Plan:
    """A second of four commands; every time and limit a sum of powers of two."""
    trial = trial_file(
        settling="0.5 s", hand_back="0.25 s", ready_within="8 s", armed_for_at_most="4 s"
    )
    point = trial.operating_point.model_copy(
        update={
            "engine_speed": 1280.0,
            "engine_speed_window": 32.0,
            "gear": GEAR,
            "steady_for": 0.5,
        }
    )
    changes = {"limits": LIMITS.model_copy(update=limits), "operating_point": point}
    return plan_of(
        trial.model_copy(update=changes), Excitation(actuator, np.array(table), period=0.25)
    )


PLAN, SPARK_PLAN = plan(), plan("spark")


def controlled(actuator: str) -> Plan:
    """The same with a controller; the waveform moves its target."""
    by_model = {
        "kind": "internal_model",
        "model": [[0.0, 1.0, 0.0, 0.0, 0.0]],
        "inverse": [],
        "delay": 0,
    }
    mixed = {
        "law": by_model,
        "throttle": BOUNDS,
        "later": [],
        "delay": 0,
        "zone": 0.0,
        "exchange": 0.1,
    }
    by_pid = {
        "kind": "pid",
        "proportional": 1.0,
        "integral": 1.0,
        "derivative": 0.0,
        "filter_time": 0.01,
        "tracking_time": 0.1,
    }
    file = parse(
        {
            "name": "c",
            "actuator": actuator,
            "limits": BOUNDS,
            **({"law": by_model, "mixed": mixed} if actuator == "mixed" else {"law": by_pid}),
        },
        ControllerFile,
        "controller.toml",
    )
    return plan_of(PLAN.trial, Excitation("slip", np.array(TABLE), 0.25), file)


BOUNDS = {"low": -0.05, "high": 0.05, "rate": 1.0}
ASKED = Offsets(0.03125, -0.0625)
AUTHORITIES = [
    ("throttle", Authority.THROTTLE),
    ("spark", Authority.SPARK),
    ("mixed", Authority.BOTH),
]


@pytest.mark.parametrize(
    ("actuator", "authority"), [("throttle", Authority.THROTTLE), ("spark", Authority.SPARK)]
)
def test_it_asks_for_the_actuator_that_is_excited_and_for_no_other(actuator, authority):
    excitation = Excitation(actuator, np.array(TABLE), 0.25)
    assert plan_of(PLAN.trial, excitation) == Plan(PLAN.trial, excitation, authority)


def live_through(sights, state=None, the_plan=PLAN, period=2.0**-6):
    """Advance by one sight every `period`; give every state."""
    state, states = state or TrialState(), []
    for number, sight in enumerate(sights):
        state = advance(state, sight, the_plan, number * period)
        states.append(state)
    return states


# By the book


def test_a_ride_by_the_book_goes_through_every_phase_in_order():
    states = live_through([RELEASED] * 50 + [PRESSED] * 200)
    assert list(dict.fromkeys(state.phase for state in states)) == [
        Phase.IDLE,
        Phase.ARMED,
        Phase.EXCITING,
        Phase.SETTLING,
        Phase.HANDING_BACK,
        Phase.DONE,
    ]


# Idle


def test_the_first_tick_starts_the_wait_and_the_steadiness():
    assert astuple(advance(TrialState(), RELEASED, PLAN, 16.0)) == astuple(
        TrialState(since=16.0, steady_since=16.0)
    )


def test_it_arms_as_soon_as_the_operating_point_stood_for_the_stated_time():
    waiting = TrialState(since=8.0, steady_since=16.0, released=True)
    assert astuple(advance(waiting, RELEASED, PLAN, below(16.5))) == astuple(waiting)
    armed = TrialState(Phase.ARMED, 16.5, 16.0, released=False)
    assert astuple(advance(waiting, RELEASED, PLAN, 16.5)) == astuple(armed)


@pytest.mark.parametrize(
    "off",
    [
        {"engine__gear": 3},
        {"engine__engine_speed": 1000.0},
        {"engine__engine_speed": NAN},
        {"oldest_age": 0.1},
        {"oldest_age": -0.1},
        {"oldest_age": NAN},
        {"throttle__faulty": True},
        {"ecu__authority": Authority.SPARK},
    ],
)
def test_off_the_operating_point_it_neither_arms_nor_stays_armed(off):
    away = changed(RELEASED, **off)
    assert astuple(live_through([away] * 100)[-1]) == astuple(TrialState(since=0.0))
    steady = TrialState(since=15.0, steady_since=16.0)
    assert astuple(advance(steady, away, PLAN, 16.25)) == astuple(TrialState(since=15.0))
    armed = TrialState(Phase.ARMED, 16.0, 15.0, released=True)
    assert astuple(advance(armed, changed(PRESSED, **off), PLAN, 17.0)) == astuple(
        TrialState(Phase.IDLE, 17.0, released=True)
    )


def test_a_motorcycle_that_never_gets_there_ends_the_trial_by_what_is_wrong():
    away = changed(RELEASED, engine__gear=3)
    waiting = TrialState(since=8.0)
    assert astuple(advance(waiting, away, PLAN, 16.0)) == astuple(waiting)
    told = Trip(TripReason.NEVER_READY, "gear 3, the trial requires 2")
    late = above(16.0)
    assert astuple(advance(waiting, away, PLAN, late)) == astuple(
        TrialState(Phase.TRIPPED, late, trip=told)
    )
    steady = TrialState(since=8.0, steady_since=20.0)
    assert astuple(advance(steady, RELEASED, PLAN, 20.25)) == astuple(steady)


@pytest.mark.parametrize(
    ("what", "last", "first", "told"),
    [
        ("oldest_age", 0.015625, above(0.015625), "EngineStatus is silent"),
        ("oldest_age", 0.0, below(0.0), "EngineStatus is silent"),
        ("oldest_age", 0.0, NAN, "EngineStatus is silent"),
        ("throttle__faulty", False, True, "the throttle body reports a fault"),
        (
            "ecu__authority",
            Authority.NONE,
            Authority.SPARK,
            "the ECU grants SPARK without a request",
        ),
        ("engine__gear", 2, 1, "gear 1, the trial requires 2"),
        (
            "engine__engine_speed",
            1312.0,
            above(1312.0),
            "engine at 12529 rpm, the trial requires 12223 +- 306 rpm",
        ),
        (
            "engine__engine_speed",
            1248.0,
            below(1248.0),
            "engine at 11918 rpm, the trial requires 12223 +- 306 rpm",
        ),
        (
            "engine__engine_speed",
            1280.0,
            NAN,
            "engine at nan rpm, the trial requires 12223 +- 306 rpm",
        ),
    ],
)
def test_what_keeps_it_from_arming_is_told(what, last, first, told):
    assert not_ready(changed(RELEASED, **{what: last}), PLAN) == ""
    assert not_ready(changed(RELEASED, **{what: first}), PLAN) == told


# Armed


def test_a_button_held_from_the_start_does_not_count():
    armed = TrialState(Phase.ARMED, 16.0)
    assert astuple(advance(armed, PRESSED, PLAN, 17.0)) == astuple(armed)
    let_go = replace(armed, released=True)
    assert astuple(advance(armed, RELEASED, PLAN, 17.0)) == astuple(let_go)
    assert astuple(advance(let_go, RELEASED, PLAN, 17.0)) == astuple(let_go)
    assert advance(let_go, PRESSED, PLAN, 17.0).phase == Phase.EXCITING


def test_the_press_takes_the_opening_and_the_grip_that_stand_now():
    armed = TrialState(Phase.ARMED, 16.0, released=True)
    state = advance(armed, PRESSED, PLAN, 17.0)
    assert astuple(state) == astuple(
        TrialState(Phase.EXCITING, 17.0, released=True, throttle=OPENING, grip=GRIP)
    )
    assert requested_command(state, PLAN, 17.0) == ActuatorCommand(
        Authority.THROTTLE, OPENING, 0.0, 17.0
    )


def test_the_button_never_pressed_ends_the_trial():
    armed = TrialState(Phase.ARMED, 16.0, released=True)
    assert astuple(advance(armed, RELEASED, PLAN, 20.0)) == astuple(armed)
    told = Trip(TripReason.NEVER_PRESSED, "the button was not pressed")
    late = above(20.0)
    after = TrialState(Phase.TRIPPED, late, released=True, trip=told)
    assert astuple(advance(armed, RELEASED, PLAN, late)) == astuple(after)


@pytest.mark.parametrize("opening", [0.09375, 0.4375])
def test_a_waveform_that_fits_into_the_range_to_the_last_float_begins(opening):
    armed = TrialState(Phase.ARMED, 16.0, released=True)
    sight = changed(PRESSED, ecu__throttle_command=opening)
    assert advance(armed, sight, PLAN, 17.0).throttle == opening


@pytest.mark.parametrize(
    ("opening", "told"),
    [
        (below(0.09375), "6.2% about 9.4% would leave 6.2% .. 50.0%"),
        (0.4375 + 2.0**-52, "6.2% about 43.8% would leave 6.2% .. 50.0%"),
        (NAN, "6.2% about nan% would leave 6.2% .. 50.0%"),
    ],
)
def test_a_waveform_that_would_leave_the_range_never_takes_authority(opening, told):
    armed = TrialState(Phase.ARMED, 16.0, released=True)
    state = advance(armed, changed(PRESSED, ecu__throttle_command=opening), PLAN, 17.0)
    assert (state.phase, state.since) == (Phase.TRIPPED, 17.0)
    assert state.trip == Trip(TripReason.RANGE, told)
    assert requested_command(state, PLAN, 17.0).authority == Authority.NONE


def test_a_trial_of_the_spark_begins_wherever_the_throttle_is():
    armed = TrialState(Phase.ARMED, 16.0, released=True)
    closed = changed(PRESSED, ecu__throttle_command=0.0)
    assert advance(armed, closed, SPARK_PLAN, 17.0).phase == Phase.EXCITING


# Holding


@pytest.mark.parametrize(
    ("phase", "lasts", "then"),
    [
        (Phase.EXCITING, 1.0, Phase.SETTLING),
        (Phase.SETTLING, 0.5, Phase.HANDING_BACK),
        (Phase.HANDING_BACK, 0.25, Phase.DONE),
    ],
)
@pytest.mark.parametrize("since", [0.0])
def test_each_phase_ends_when_its_time_is_up(phase, lasts, then, since):
    state = TrialState(phase, since, throttle=OPENING, grip=GRIP, target=0.2)
    over = since + (lasts - CLOCK_RESOLUTION)
    assert astuple(advance(state, PRESSED, PLAN, below(over))) == astuple(state)
    after = advance(state, PRESSED, PLAN, over)
    assert (after.phase, after.since) == (then, over)
    kept = GRIP if then == Phase.HANDING_BACK else 0.2
    assert astuple(after) == astuple(replace(state, phase=then, since=over, target=kept))


def test_letting_go_during_the_excitation_is_left_to_permit_and_after_it_is_a_hand_back():
    exciting = TrialState(Phase.EXCITING, 16.0, throttle=OPENING)
    assert astuple(advance(exciting, RELEASED, PLAN, 16.5)) == astuple(exciting)
    for phase in (Phase.SETTLING, Phase.HANDING_BACK):
        state = TrialState(phase, 16.0, throttle=OPENING)
        assert astuple(advance(state, RELEASED, PLAN, 16.125)) == astuple(
            TrialState(Phase.DONE, 16.125, throttle=OPENING)
        )


@pytest.mark.parametrize(
    ("grip", "throttle", "target"),
    [
        (0.1875, 0.25, 0.1875),  # within reach: the grip itself
        (1.0, 0.25, 0.375),
        (0.0625, 0.25, 0.125),  # as far as the deviation allows
        (1.0, 0.4375, 0.5),
        (0.0, 0.125, 0.0625),  # as far as the range allows
    ],
)
def test_the_hand_back_aims_at_the_grip_as_far_as_range_and_deviation_allow(grip, throttle, target):
    state = TrialState(Phase.SETTLING, 16.0, throttle=throttle)
    sight = changed(PRESSED, rider__grip=grip)
    assert advance(state, sight, PLAN, 17.0).target == target


@given(st.floats(0, 1), st.floats(0.0625, 0.5))
def test_hand_back_stays_within_range_and_deviation_wherever_the_grip_is(grip, throttle):
    state = TrialState(Phase.SETTLING, 0.0, throttle=throttle)
    state = advance(state, changed(PRESSED, rider__grip=grip), PLAN, 1.0)
    assert abs(state.target - throttle) <= LIMITS.throttle_deviation + 1e-12
    assert LIMITS.throttle[0] <= state.target <= LIMITS.throttle[1]


# Ended


@given(st.sampled_from(sorted(ENDED)), st.booleans(), st.floats(0, 100))
def test_an_ended_trial_stays_ended_and_keeps_its_first_reason(phase, button, now):
    state = TrialState(phase, 0.0, trip=TRIP)
    assert astuple(advance(state, changed(PRESSED, rider__button=button), PLAN, now)) == astuple(
        state
    )
    assert astuple(tripped(state, Trip(TripReason.SLIP, "slip"), now)) == astuple(state)


@pytest.mark.parametrize("phase", sorted(set(Phase) - ENDED))
def test_a_trip_ends_every_other_phase(phase):
    state = TrialState(phase, 16.0, throttle=OPENING)
    assert astuple(tripped(state, TRIP, 17.0)) == astuple(
        TrialState(Phase.TRIPPED, 17.0, throttle=OPENING, trip=TRIP)
    )


# What it asks for


@pytest.mark.parametrize("phase", sorted(set(Phase) - HOLDING))
def test_without_the_riders_leave_it_asks_for_nothing(phase):
    state = TrialState(phase, 16.0, throttle=OPENING, target=0.5)
    assert requested_command(state, PLAN, 16.25) == ActuatorCommand(Authority.NONE, 0.0, 0.0, 16.25)


@pytest.mark.parametrize(
    ("plan_", "authority"), [(PLAN, Authority.THROTTLE), (SPARK_PLAN, Authority.SPARK)]
)
@pytest.mark.parametrize(("after", "due"), [(0.0, 0.0), (0.25, 0.03125), (0.5, 0.0625), (1.0, 0.0)])
def test_the_excitation_asks_for_what_is_due(plan_, authority, after, due):
    state = TrialState(Phase.EXCITING, 16.0, throttle=OPENING)
    throttle, spark = (OPENING + due, 0.0) if authority == Authority.THROTTLE else (0.0, due)
    asked = ActuatorCommand(authority, throttle, spark, 16.0 + after)
    assert requested_command(state, plan_, 16.0 + after) == asked


@pytest.mark.parametrize("phase", [Phase.SETTLING, Phase.HANDING_BACK])
def test_after_the_excitation_the_spark_is_the_map_s(phase):
    """Even at a moment at which the waveform, if it were played again, would have a value."""
    state = TrialState(phase, 16.0, throttle=OPENING, target=0.125)
    assert requested_command(state, SPARK_PLAN, 16.25) == ActuatorCommand(
        Authority.SPARK, 0.0, 0.0, 16.25
    )


def test_settling_stays_at_the_operating_point():
    state = TrialState(Phase.SETTLING, 16.0, throttle=OPENING, target=0.125)
    assert requested_command(state, PLAN, 16.25) == ActuatorCommand(
        Authority.THROTTLE, OPENING, 0.0, 16.25
    )


@pytest.mark.parametrize(
    ("after", "throttle"),
    [(0.0, 0.25), (0.0625, 0.21875), (0.125, 0.1875), (0.25, 0.125), (0.5, 0.125)],
)
def test_the_hand_back_is_a_ramp_from_the_operating_point_to_the_aim(after, throttle):
    state = TrialState(Phase.HANDING_BACK, 16.0, throttle=OPENING, target=0.125)
    now = 16.0 + after
    assert requested_command(state, PLAN, now) == ActuatorCommand(
        Authority.THROTTLE, throttle, 0.0, now
    )


@pytest.mark.parametrize("now", [NAN, math.inf, -math.inf, 1e300, -1e300])
@pytest.mark.parametrize("phase", sorted(Phase))
def test_no_time_however_strange_makes_it_raise(phase, now):
    """What it then asks for is judged by permit, which trips on such a clock."""
    state = TrialState(phase, 16.0, throttle=OPENING, target=OPENING, released=True)
    for the_plan in (PLAN, SPARK_PLAN):
        assert requested_command(state, the_plan, now).authority in (
            Authority.NONE,
            the_plan.authority,
        )
        assert advance(state, PRESSED, the_plan, now).phase in Phase
    blank = replace(state, since=NAN, throttle=NAN, target=NAN)
    assert requested_command(blank, PLAN, 16.0).authority in (Authority.NONE, Authority.THROTTLE)


@given(st.lists(st.booleans(), max_size=60), st.sampled_from(list(Phase)))
def test_only_holding_phases_ever_ask_for_authority(buttons, phase):
    state = TrialState(phase, 0.0, throttle=OPENING, target=OPENING, released=True)
    for number, button in enumerate(buttons):
        state = advance(state, changed(PRESSED, rider__button=button), PLAN, number * 0.1)
        asked = requested_command(state, PLAN, number * 0.1).authority
        assert (asked != Authority.NONE) == (state.phase in HOLDING)


# Under a controller


@pytest.mark.parametrize(("actuator", "authority"), AUTHORITIES)
@pytest.mark.parametrize("phase", [Phase.EXCITING, Phase.SETTLING])
def test_a_controllers_word_counts_for_what_it_may_move_and_for_nothing_else(
    actuator, authority, phase
):
    state = TrialState(phase, 16.0, throttle=OPENING)
    throttle = OPENING + 0.03125 if authority & Authority.THROTTLE else 0.0
    spark = -0.0625 if authority & Authority.SPARK else 0.0
    assert requested_command(state, controlled(actuator), 16.25, ASKED) == ActuatorCommand(
        authority, throttle, spark, 16.25
    )


@pytest.mark.parametrize("phase", sorted(Phase))
def test_a_controller_has_the_say_from_the_button_until_the_hand_back(phase):
    state = TrialState(phase, 16.0, throttle=OPENING)
    has_it = phase in (Phase.EXCITING, Phase.SETTLING)
    assert controller_active(state, controlled("mixed")) == has_it
    assert not controller_active(state, PLAN)


@pytest.mark.parametrize(("phase", "value"), [(Phase.EXCITING, 0.03125), (Phase.SETTLING, 0.0)])
def test_the_waveform_is_due_while_it_excites(phase, value):
    assert waveform_value(TrialState(phase, 16.0), PLAN, 16.25) == value


@pytest.mark.parametrize(
    ("after", "throttle", "spark"),
    [(0.0, 0.28125, -0.0625), (0.125, 0.203125, -0.03125), (0.25, 0.125, 0.0), (0.5, 0.125, 0.0)],
)
def test_the_hand_back_begins_where_the_controller_stood(after, throttle, spark):
    state = TrialState(Phase.HANDING_BACK, 16.0, throttle=OPENING, target=0.125, ramp_start=ASKED)
    now = 16.0 + after
    asked = ActuatorCommand(Authority.BOTH, throttle, spark, now)
    assert requested_command(state, controlled("mixed"), now) == asked


def test_what_the_controller_asked_for_last_is_kept_for_the_hand_back():
    the_plan = controlled("mixed")
    state = TrialState(Phase.SETTLING, 16.0, throttle=OPENING)
    stays = advance(state, PRESSED, the_plan, 16.25, ASKED)
    assert (stays.phase, stays.ramp_start) == (Phase.SETTLING, NO_OFFSETS)
    ends = advance(state, PRESSED, the_plan, 16.5, ASKED)
    assert (ends.phase, ends.ramp_start) == (Phase.HANDING_BACK, ASKED)
    assert advance(state, PRESSED, the_plan, 16.5).ramp_start == NO_OFFSETS


def test_a_target_that_swings_widely_is_not_taken_for_a_throttle():
    """A waveform of slip may be larger than the throttle's range and still begin."""
    wide = replace(controlled("throttle"), excitation=Excitation("slip", np.array([9.0]), 0.25))
    armed = TrialState(Phase.ARMED, 16.0, released=True)
    assert advance(armed, PRESSED, wide, 16.25).phase == Phase.EXCITING
