"""No command passes that the rider, the motorcycle or the limits do not allow.

Each limit is tried on both sides of its last float, so that no comparison can be another.
"""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.bench.safety.permit import CLOCK_RESOLUTION, TOLERANCE, Trip, permit
from slipbench.protocol.codec.messages import ActuatorCommand, TripReason
from tests.bench.safety.sights import (
    BOTH,
    GRIP,
    LIMITS,
    NONE,
    NOW,
    OPENING,
    PERIOD,
    SILENCE,
    SPARK,
    THROTTLE,
    above,
    below,
    command,
    held,
    vehicle_state,
)

NAN = math.nan
R = TripReason


def answer(asked=None, before=None, sight=None):
    return permit(asked or command(), before or held(), sight or vehicle_state(), LIMITS, SILENCE)


def passes(asked=None, before=None, sight=None):
    asked = asked or command()
    return answer(asked, before, sight) is asked


@pytest.mark.parametrize("authority", [THROTTLE, SPARK, BOTH])
def test_a_command_within_all_limits_passes_unchanged(authority):
    assert passes(command(authority), held(authority), vehicle_state(authority))


@pytest.mark.parametrize(
    "sight", [vehicle_state(), vehicle_state(bus_off=True), vehicle_state(rider__button=False)]
)
def test_a_release_always_passes_and_is_neutral(sight):
    release = ActuatorCommand(NONE, 0.7, 0.3, NOW)
    assert answer(release, None, sight) == ActuatorCommand(NONE, 0.0, 0.0, NOW)


# What is seen, the last value that passes, the first that does not, and what the user is told.
EDGES = [
    ("bus_off", False, True, R.BUS_OFF, "the CAN controller is off the bus"),
    ("recording", True, False, R.RECORDER, "the recorder cannot write"),
    ("oldest_age", 0.015625, above(0.015625), R.STALE, "EngineStatus: silent for 15.6 ms"),
    ("oldest_age", 0.0, -1.0, R.STALE, "EngineStatus: silent for -1000.0 ms"),
    ("oldest_age", 0.0, below(0.0), R.STALE, "EngineStatus: silent for -0.0 ms"),
    ("oldest_age", 0.0, 2.0, R.STALE, "EngineStatus: silent for 2000.0 ms"),
    ("oldest_age", 0.0, NAN, R.STALE, "EngineStatus: silent for nan ms"),
    ("faults", 2, 3, R.FAULTY, "RearTeeth: 3 faulty frames in a row"),
    ("faults", 0, 4, R.FAULTY, "RearTeeth: 4 faulty frames in a row"),
    ("throttle__faulty", False, True, R.THROTTLE_FAULT, "the throttle body reports a fault"),
    ("ecu__authority", THROTTLE, NONE, R.AUTHORITY_LOST, "asked for THROTTLE, the ECU grants NONE"),
    (
        "ecu__authority",
        THROTTLE,
        SPARK,
        R.AUTHORITY_LOST,
        "asked for THROTTLE, the ECU grants SPARK",
    ),
    ("ecu__authority", THROTTLE, BOTH, R.AUTHORITY_LOST, "asked for THROTTLE, the ECU grants BOTH"),
    (
        "throttle__authority",
        BOTH,
        NONE,
        R.AUTHORITY_LOST,
        "asked for THROTTLE, the throttle body grants NONE",
    ),
    (
        "throttle__authority",
        THROTTLE,
        SPARK,
        R.AUTHORITY_LOST,
        "asked for THROTTLE, the throttle body grants SPARK",
    ),
    ("rider__button", True, False, R.BUTTON_RELEASED, "the rider let go of the button"),
    ("rider__front_brake", below(262144.0), 262144.0, R.BRAKE, "brake at 2.62 bar"),
    ("rider__rear_brake", below(262144.0), 262144.0, R.BRAKE, "brake at 2.62 bar"),
    ("rider__rear_brake", 0.0, 1e9, R.BRAKE, "brake at 10000.00 bar"),
    ("rider__front_brake", 0.0, NAN, R.BRAKE, "brake at nan bar"),
    ("rider__rear_brake", 0.0, NAN, R.BRAKE, "brake at nan bar"),
    ("rider__clutch", below(0.125), 0.125, R.CLUTCH, "clutch at 12%"),
    ("rider__clutch", 0.0, NAN, R.CLUTCH, "clutch at nan%"),
    ("rider__grip", GRIP, 0.03125, R.GRIP_CLOSED, "grip at 3.1%"),
    ("rider__grip", GRIP, NAN, R.GRIP_CLOSED, "grip at nan%"),
    ("rider__grip", 0.0625, below(0.0625), R.GRIP_CLOSED, "grip at 6.2%, at the button 18.8%"),
    ("rider__grip", 0.3125, above(0.3125), R.GRIP_OPENED, "grip at 31.3%, at the button 18.8%"),
    ("engine__gear", 2, 3, R.GEAR, "gear 3, the trial began in 2"),
    ("engine__gear", 2, 1, R.GEAR, "gear 1, the trial began in 2"),
    ("engine__engine_speed", 1536.0 + TOLERANCE, 1600.0, R.ENGINE_SPEED, "engine at 15279 rpm"),
    ("engine__engine_speed", 1024.0 - TOLERANCE, 1000.0, R.ENGINE_SPEED, "engine at 9549 rpm"),
    ("engine__engine_speed", 1280.0, NAN, R.ENGINE_SPEED, "engine at nan rpm"),
    ("speed", 64.0 + TOLERANCE, 64.25, R.SPEED, "64.2 m/s"),
    ("speed", 32.0 - TOLERANCE, 31.75, R.SPEED, "31.8 m/s"),
    ("speed", 48.0, NAN, R.SPEED, "nan m/s"),
    ("slip", 0.125, above(0.125), R.SLIP, "slip of 12.5%"),
    ("slip", -0.125, below(-0.125), R.SLIP, "slip of -12.5%"),  # the rear wheel locks
    ("slip", 0.0, NAN, R.SLIP, "slip of nan%"),
    ("front_slip", 0.25, above(0.25), R.FRONT_WHEEL, "front wheel +25.0% off the speed"),
    ("front_slip", -0.25, below(-0.25), R.FRONT_WHEEL, "front wheel -25.0% off the speed"),
    ("front_slip", 0.0, NAN, R.FRONT_WHEEL, "front wheel +nan% off the speed"),
    ("distance", 2048.0, above(2048.0), R.DISTANCE, "2048 m since the button"),
    ("distance", 0.0, NAN, R.DISTANCE, "nan m since the button"),
]


@pytest.mark.parametrize(("what", "last", "first", "reason", "detail"), EDGES)
def test_each_thing_seen_trips_beyond_its_limit_by_its_own_name(what, last, first, reason, detail):
    assert passes(sight=vehicle_state(**{what: last}))
    assert answer(sight=vehicle_state(**{what: first})) == Trip(reason, detail)


@pytest.mark.parametrize("infinite", [math.inf, -math.inf])
@pytest.mark.parametrize("what", sorted({what for what, last, *_ in EDGES if type(last) is float}))
def test_what_is_infinite_is_never_within_a_limit_but_for_a_pull_below_nothing(what, infinite):
    one_sided = what in ("rider__front_brake", "rider__rear_brake", "rider__clutch", "distance")
    assert passes(sight=vehicle_state(**{what: infinite})) == (one_sided and infinite < 0)


def test_closed_means_closed_even_where_the_grip_hardly_moved():
    resting = held(grip=0.0625)
    assert passes(before=resting, sight=vehicle_state(rider__grip=above(0.03125)))
    told = answer(before=resting, sight=vehicle_state(rider__grip=0.03125))
    assert told == Trip(R.GRIP_CLOSED, "grip at 3.1%")


def test_in_a_trial_of_the_spark_the_grip_is_the_riders_and_may_move():
    wide_open = vehicle_state(SPARK, rider__grip=1.0)
    assert passes(command(SPARK), held(SPARK), wide_open)


def test_a_grip_that_was_not_known_at_the_button_does_not_pass():
    assert answer(before=held(grip=NAN)).reason == R.GRIP_CLOSED


# The bench's own time


@pytest.mark.parametrize(
    ("ago", "told"),
    [
        (0.0, "0.0 ms"),
        (-1.0, "-1000.0 ms"),
        (2.0, "2000.0 ms"),
        (NAN, "nan ms"),
        (math.inf, "inf ms"),
        (above(SILENCE + CLOCK_RESOLUTION), "31.3 ms"),
    ],
)
def test_a_clock_that_stands_goes_back_or_jumps_trips(ago, told):
    """A bench that was stopped must not go on: its rate limit would have grown with the pause."""
    asked = command(time=ago)
    before = held(last=command(time=0.0), requested_since=0.0)
    assert answer(asked, before) == Trip(R.TIMING, f"the bench's last command was {told} ago")


@pytest.mark.parametrize("ago", [above(0.0), PERIOD, SILENCE, SILENCE + CLOCK_RESOLUTION])
def test_a_late_tick_passes_as_long_as_the_devices_wait(ago):
    assert passes(command(time=ago), held(last=command(time=0.0), requested_since=0.0))


@pytest.mark.parametrize("field", ["ecu__authority", "throttle__authority"])
def test_the_devices_have_the_silence_time_to_grant_authority(field):
    refused = vehicle_state(**{field: NONE})
    assert passes(before=held(requested_since=NOW - SILENCE), sight=refused)
    for since in (below(NOW - SILENCE), NAN):
        assert answer(before=held(requested_since=since), sight=refused).reason == R.AUTHORITY_LOST


def test_the_throttle_body_is_not_asked_about_the_spark():
    sight = vehicle_state(SPARK, throttle__authority=NONE)
    assert passes(command(SPARK), held(SPARK), sight)
    held_too_much = vehicle_state(SPARK, throttle__authority=THROTTLE)
    assert answer(command(SPARK), held(SPARK), held_too_much).detail == (
        "asked for SPARK, the throttle body grants THROTTLE"
    )


# The command itself


def steps(**changes):
    """A command, and what was held before it: `throttle=(0.25, 0.253)` moves from one to other."""
    before = {name: pair[0] for name, pair in changes.items()}
    after = {name: pair[1] for name, pair in changes.items()}
    authority = SPARK if "spark" in changes else THROTTLE
    last = command(authority, time=NOW - PERIOD, **before)
    return command(authority, **after), held(authority, last=last), vehicle_state(authority)


def test_the_throttle_stays_within_the_deviation_from_the_operating_point():
    for edge in (OPENING + 0.125, OPENING - 0.125):
        assert passes(*steps(throttle=(edge, edge)))
    for beyond, told in ((0.375001, "12.50%"), (0.124, "12.60%"), (NAN, "nan%")):
        trip = Trip(R.AMPLITUDE, f"throttle {told} off the operating point")
        assert answer(*steps(throttle=(0.25, beyond))) == trip
    assert answer(*steps(throttle=(0.25, math.inf))).reason == R.AMPLITUDE


def test_the_deviation_is_exact_but_for_the_tolerance():
    low = held(throttle=0.0, last=command(throttle=0.125, time=NOW - PERIOD))
    assert passes(command(throttle=0.125 + TOLERANCE), low)
    assert answer(command(throttle=above(0.125 + TOLERANCE)), low).reason == R.AMPLITUDE


@pytest.mark.parametrize(
    ("opening", "edge", "beyond", "told"),
    [
        (0.125, 0.0625 - TOLERANCE, below(0.0625 - TOLERANCE), "6.25%"),
        (0.125, 0.0625 - TOLERANCE, 0.062, "6.20%"),
        (0.46875, 0.5 + TOLERANCE, above(0.5 + TOLERANCE), "50.00%"),
        (0.46875, 0.5 + TOLERANCE, 0.5001, "50.01%"),
    ],
)
def test_the_throttle_stays_in_its_range_within_the_deviation(opening, edge, beyond, told):
    before = held(throttle=opening, last=command(throttle=edge, time=NOW - PERIOD))
    assert passes(command(throttle=edge), before)
    trip = Trip(R.RANGE, f"throttle command of {told}")
    assert answer(command(throttle=beyond), before) == trip


@pytest.mark.parametrize(
    ("edge", "beyond", "told"),
    [
        (-0.25 - TOLERANCE, below(-0.25 - TOLERANCE), "-14.32 deg"),
        (0.125 + TOLERANCE, above(0.125 + TOLERANCE), "7.16 deg"),
        (0.0, 1.0, "57.30 deg"),
        (0.0, NAN, "nan deg"),
        (0.0, -math.inf, "-inf deg"),
    ],
)
def test_the_spark_stays_in_its_range(edge, beyond, told):
    assert passes(*steps(spark=(edge, edge)))
    assert answer(*steps(spark=(0.0, beyond))) == Trip(R.RANGE, f"spark command of {told}")


def test_neither_moves_faster_than_its_rate():
    """From where the last command was; a clock of floats since 1970 costs no trip."""
    near = replace(held(), throttle=0.0625)
    most = LIMITS.throttle_rate * (PERIOD + CLOCK_RESOLUTION)
    start = replace(near, last=command(throttle=0.0, time=NOW - PERIOD))
    wide = LIMITS.model_copy(update={"throttle": (-1.0, 1.0)})
    for sign in (1.0, -1.0):
        fast, faster = command(throttle=sign * most), command(throttle=sign * above(most))
        start = replace(start, throttle=sign * 0.0625)
        assert permit(fast, start, vehicle_state(), wide, SILENCE) is fast
        told = f"throttle asked to move {sign * 0.003910:.4g} in 0.98 ms"
        assert permit(faster, start, vehicle_state(), wide, SILENCE) == Trip(R.RATE, told)
    most = LIMITS.spark_rate * (PERIOD + CLOCK_RESOLUTION)
    assert passes(*steps(spark=(0.0, most)))
    told = "spark asked to move 0.01564 in 0.98 ms"
    assert answer(*steps(spark=(0.0, above(most)))) == Trip(R.RATE, told)
    assert answer(*steps(spark=(0.0, -above(most)))).reason == R.RATE


def test_after_a_late_tick_the_rate_is_judged_over_the_time_that_passed():
    late = held(SPARK, last=command(SPARK, spark=-0.25, time=0.0), requested_since=0.0)
    assert passes(command(SPARK, time=0.0234375, spark=0.125), late, vehicle_state(SPARK))
    told = "spark asked to move 0.375 in 23.42 ms"
    hasty = command(SPARK, time=0.02342, spark=0.125)
    assert answer(hasty, late, vehicle_state(SPARK)) == Trip(R.RATE, told)


@pytest.mark.parametrize("authority", [THROTTLE, SPARK, BOTH])
def test_the_rate_is_counted_from_the_last_command_of_that_actuator(authority):
    last = command(authority, throttle=0.125, spark=0.125, time=NOW - PERIOD)
    before, sight = held(authority, last=last), vehicle_state(authority)
    asked = command(authority, throttle=0.125, spark=0.125)
    asked = replace(asked, throttle=0.0) if authority == SPARK else asked
    asked = replace(asked, spark=0.0) if authority == THROTTLE else asked
    assert passes(asked, before, sight)


@pytest.mark.parametrize("nothing", [NONE, SPARK])
def test_the_first_command_of_the_throttle_may_not_jump_from_the_operating_point(nothing):
    first = held(last=command(nothing, time=NOW - PERIOD))
    assert passes(before=first)
    assert answer(command(throttle=OPENING + 0.004), first).reason == R.RATE


@pytest.mark.parametrize("nothing", [NONE, THROTTLE])
def test_the_first_command_of_the_spark_may_not_jump_from_the_map(nothing):
    first = held(SPARK, last=command(nothing, spark=0.125, time=NOW - PERIOD))
    assert passes(command(SPARK), first, vehicle_state(SPARK))
    assert answer(command(SPARK, spark=0.016), first, vehicle_state(SPARK)).reason == R.RATE


def test_what_is_not_asked_for_stays_neutral():
    spark = answer(command(spark=0.0625))
    assert spark == Trip(R.RANGE, "spark of 0.0625 without authority over it")
    throttle = answer(command(SPARK, throttle=0.25), held(SPARK), vehicle_state(SPARK))
    assert throttle == Trip(R.RANGE, "throttle of 0.25 without authority over it")
    assert answer(command(spark=NAN)).reason == R.RANGE


def test_a_pause_does_not_widen_the_rate_limit_beyond_the_silence_time():
    """After two seconds the whole deviation would have passed as slow enough."""
    asked = command(throttle=OPENING + 0.125)
    before = held(last=command(time=NOW - 2.0))
    assert answer(asked, before).reason == R.TIMING


def test_a_ramp_at_the_rate_limit_passes_at_every_time_of_day():
    """Seconds since 1970 have a float's resolution of 0.24 us: no ramp may trip over that."""
    step = LIMITS.throttle_rate * 0.001
    for millisecond in range(1_790_000_000_000, 1_790_000_002_000):
        before, now = millisecond / 1000, (millisecond + 1) / 1000
        last = command(time=before)
        asked = command(throttle=OPENING + step, time=now)
        assert passes(asked, held(last=last, requested_since=before - 1.0))


number = st.one_of(
    st.floats(allow_nan=True, allow_infinity=True), st.floats(0.0, 0.5), st.floats(-0.02, 0.02)
)


@given(number, number, number, st.sampled_from([THROTTLE, SPARK, BOTH]))
def test_whatever_passes_lies_within_every_limit(throttle, spark, elapsed, authority):
    asked = ActuatorCommand(authority, throttle, spark, NOW + elapsed)
    before = held(authority, last=command(authority, time=NOW))
    told = answer(asked, before, vehicle_state(authority))
    if isinstance(told, Trip):
        return
    assert told is asked
    assert 0 < elapsed <= SILENCE + 1e-5
    if authority & THROTTLE:
        assert LIMITS.throttle[0] - 1e-6 <= throttle <= LIMITS.throttle[1] + 1e-6
        assert abs(throttle - OPENING) <= LIMITS.throttle_rate * elapsed + 1e-5
    else:
        assert throttle == 0.0
    if authority & SPARK:
        assert LIMITS.spark[0] - 1e-6 <= spark <= LIMITS.spark[1] + 1e-6
        assert abs(spark) <= LIMITS.spark_rate * elapsed + 1e-4
    else:
        assert spark == 0.0
