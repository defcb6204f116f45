"""Laws of the trial's state machine."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.permit import Trip
from bench.trial import ENDED, HOLDING, TrialState, advance, tripped, wanted
from protocol.messages import Authority, Phase, TripReason
from tests.bench.conditions import OPENING, engine, plan, rider, seen

MILLISECOND = 0.001
ORDER = [Phase.IDLE, Phase.ARMED, Phase.EXCITING, Phase.SETTLING, Phase.HANDING_BACK, Phase.DONE]


def live_through(sights, the_plan=None, state=None):
    """Advance by one sight a millisecond; return every state."""
    the_plan = the_plan or plan()
    state, states = state or TrialState(), []
    for number, sight in enumerate(sights):
        state = advance(state, sight, the_plan, number * MILLISECOND)
        states.append(state)
    return states


def armed(the_plan=None):
    return live_through([seen()] * 700, the_plan)[-1]


def test_a_ride_by_the_book_goes_through_every_phase_in_order():
    pressed = seen(rider=rider(button=True))
    states = live_through([seen()] * 700 + [pressed] * 4000)
    phases = [state.phase for state in states]
    assert list(dict.fromkeys(phases)) == ORDER


def test_no_phase_asks_for_authority_before_the_button():
    for state in live_through([seen()] * 2000):
        assert wanted(state, plan(), 0.0).authority == Authority.NONE


def test_it_arms_only_after_the_operating_point_stood_for_the_stated_time():
    states = live_through([seen()] * 700)
    first = next(i for i, s in enumerate(states) if s.phase == Phase.ARMED)
    assert first * MILLISECOND == pytest.approx(0.5, abs=0.0015)


@pytest.mark.parametrize(
    "off",
    [
        {"engine": engine(gear=3)},
        {"engine": engine(engine_speed=1000.0)},
        {"engine": engine(engine_speed=math.nan)},
        {"oldest_age": 0.1},
    ],
)
def test_it_neither_arms_nor_stays_armed_off_the_operating_point(off):
    assert live_through([seen(**off)] * 2000)[-1].phase == Phase.IDLE
    assert advance(armed(), seen(**off), plan(), 1.0).phase == Phase.IDLE


def test_a_button_held_from_the_start_does_not_count():
    held = seen(rider=rider(button=True))
    assert live_through([held] * 3000)[-1].phase == Phase.ARMED


def test_the_press_is_answered_in_the_same_tick_around_the_opening_that_stood():
    state = advance(armed(), seen(rider=rider(button=True)), plan(), 1.0)
    command = wanted(state, plan(), 1.0)
    assert (state.phase, command.authority) == (Phase.EXCITING, Authority.THROTTLE)
    assert command.throttle == pytest.approx(OPENING)


def test_a_waveform_that_would_leave_the_range_never_takes_authority():
    pressed = seen(rider=rider(button=True))
    near = replace(pressed, ecu=replace(pressed.ecu, throttle_command=0.02))
    state = advance(armed(), near, plan(), 1.0)
    assert state.trip is not None
    assert state.trip.reason == TripReason.RANGE
    assert "2.0% about 2.0%" in state.trip.detail


def test_the_button_never_pressed_ends_the_trial():
    state = advance(armed(), seen(), plan(), 200.0)
    assert state.trip is not None
    assert state.trip.reason == TripReason.NEVER_PRESSED


def test_letting_go_after_the_excitation_hands_back_without_a_trip():
    for phase in (Phase.SETTLING, Phase.HANDING_BACK):
        state = TrialState(phase, 1.0, throttle=OPENING, target=OPENING)
        after = advance(state, seen(), plan(), 1.1)
        assert (after.phase, after.trip) == (Phase.DONE, None)


def test_hand_back_ends_at_the_grip_and_starts_at_the_operating_point():
    grip = OPENING + 0.02
    state = TrialState(Phase.SETTLING, 0.0, throttle=OPENING)
    state = advance(state, seen(rider=rider(button=True, grip=grip)), plan(), 1.0)
    assert state.phase == Phase.HANDING_BACK
    assert wanted(state, plan(), 1.0).throttle == pytest.approx(OPENING)
    assert wanted(state, plan(), 1.5).throttle == pytest.approx(grip)


@given(st.floats(0, 1))
def test_hand_back_stays_within_range_and_deviation_wherever_the_grip_is(grip):
    state = TrialState(Phase.SETTLING, 0.0, throttle=OPENING)
    state = advance(state, seen(rider=rider(button=True, grip=grip)), plan(), 1.0)
    limits = plan().trial.limits
    assert abs(state.target - OPENING) <= limits.throttle_deviation + 1e-12
    assert limits.throttle[0] <= state.target <= limits.throttle[1]


@given(st.sampled_from(sorted(ENDED)), st.booleans(), st.floats(0, 100))
def test_an_ended_trial_stays_ended_and_keeps_its_first_reason(phase, button, now):
    first = Trip(TripReason.BRAKE, "brake")
    state = TrialState(phase, 0.0, trip=first)
    assert advance(state, seen(rider=rider(button=button)), plan(), now) == state
    assert tripped(state, Trip(TripReason.SLIP, "slip"), now).trip == first


@given(st.lists(st.booleans(), max_size=60), st.sampled_from(list(Phase)))
def test_only_holding_phases_ever_ask_for_authority(buttons, phase):
    state = TrialState(phase, 0.0, throttle=OPENING, target=OPENING, released=True)
    for number, button in enumerate(buttons):
        state = advance(state, seen(rider=rider(button=button)), plan(), number * 0.1)
        asked = wanted(state, plan(), number * 0.1).authority
        assert (asked != Authority.NONE) == (state.phase in HOLDING)


def test_a_spark_trial_asks_for_spark_alone_and_leaves_the_throttle_to_the_rider():
    the_plan = plan(excitation__actuator="spark", excitation__amplitude="3 deg")
    state = TrialState(Phase.EXCITING, 0.0, throttle=OPENING)
    asked = [wanted(state, the_plan, t * MILLISECOND) for t in range(2000)]
    assert {a.authority for a in asked} == {Authority.SPARK}
    assert {a.throttle for a in asked} == {0.0}
    assert max(a.spark for a in asked) == pytest.approx(math.radians(3.0), rel=1e-3)
