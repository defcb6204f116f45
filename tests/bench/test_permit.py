"""No command passes that the rider, the motorcycle or the limits do not allow."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.permit import Held, Trip, permit
from protocol.messages import ActuatorCommand, Authority, EcuStatus, TripReason
from tests.bench.conditions import OPENING, engine, rider, seen, trial_file

LIMITS = trial_file().limits
SILENCE = 0.02
NOW = 10.0
BEFORE = ActuatorCommand(Authority.THROTTLE, OPENING, 0.0, NOW - 0.001)
HELD = Held(OPENING, 2, BEFORE, NOW - 1.0)
ASKED = ActuatorCommand(Authority.THROTTLE, OPENING + 0.0004, 0.0, NOW)
SPARK_BEFORE = ActuatorCommand(Authority.SPARK, 0.0, 0.0, NOW - 0.001)
SPARK_HELD = Held(OPENING, 2, SPARK_BEFORE, NOW - 1.0)
SPARK_ASKED = ActuatorCommand(Authority.SPARK, 0.0, 0.01, NOW)


def granted(authority=Authority.THROTTLE, **changes):
    fine = {
        "ecu": EcuStatus(authority, OPENING, 0.0, NOW),
        "rider": rider(button=True),
    }
    return seen(**{**fine, **changes})


def reason(command=ASKED, sight=None, held=HELD, limits=LIMITS):
    answer = permit(command, held, sight or granted(), limits, SILENCE)
    return answer.reason if isinstance(answer, Trip) else None


def test_a_command_within_all_limits_passes_unchanged():
    assert permit(ASKED, HELD, granted(), LIMITS, SILENCE) is ASKED
    spark = granted(Authority.SPARK)
    assert permit(SPARK_ASKED, SPARK_HELD, spark, LIMITS, SILENCE) is SPARK_ASKED


def test_a_release_always_passes_and_is_neutral():
    release = ActuatorCommand(Authority.NONE, 0.7, 0.3, NOW)
    answer = permit(release, HELD, seen(bus_off=True), LIMITS, SILENCE)
    assert answer == ActuatorCommand(Authority.NONE, 0.0, 0.0, NOW)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({"bus_off": True}, TripReason.BUS_OFF),
        ({"recording": False}, TripReason.RECORDER),
        ({"oldest_age": 0.0151}, TripReason.STALE),
        ({"oldest_age": math.nan}, TripReason.STALE),
        ({"faults": 3}, TripReason.FAULTY),
        ({"throttle": replace(seen().throttle, faulty=True)}, TripReason.THROTTLE_FAULT),
        ({"ecu": EcuStatus(Authority.NONE, 0.1, 0.0, NOW)}, TripReason.AUTHORITY_LOST),
        ({"rider": rider(button=False)}, TripReason.BUTTON_RELEASED),
        ({"rider": rider(button=True, front_brake=2.1e5)}, TripReason.BRAKE),
        ({"rider": rider(button=True, rear_brake=2.1e5)}, TripReason.BRAKE),
        ({"rider": rider(button=True, front_brake=math.nan)}, TripReason.BRAKE),
        ({"rider": rider(button=True, clutch=0.11)}, TripReason.CLUTCH),
        ({"rider": rider(button=True, clutch=math.nan)}, TripReason.CLUTCH),
        ({"rider": rider(button=True, grip=0.019)}, TripReason.GRIP_CLOSED),
        ({"rider": rider(button=True, grip=math.nan)}, TripReason.GRIP_CLOSED),
        ({"engine": engine(gear=3)}, TripReason.GEAR),
        ({"engine": engine(engine_speed=1100.0)}, TripReason.ENGINE_SPEED),
        ({"engine": engine(engine_speed=1700.0)}, TripReason.ENGINE_SPEED),
        ({"engine": engine(engine_speed=math.nan)}, TripReason.ENGINE_SPEED),
        ({"speed": 29.9}, TripReason.SPEED),
        ({"speed": 70.1}, TripReason.SPEED),
        ({"speed": math.nan}, TripReason.SPEED),
        ({"slip": 0.081}, TripReason.SLIP),
        ({"slip": math.nan}, TripReason.SLIP),
        ({"distance": 2500.1}, TripReason.DISTANCE),
        ({"distance": math.nan}, TripReason.DISTANCE),
    ],
)
def test_each_thing_seen_trips_by_its_own_name(changes, expected):
    assert reason(sight=granted(**changes)) == expected


@pytest.mark.parametrize(
    ("command", "expected"),
    [
        (replace(ASKED, throttle=OPENING + 0.0601), TripReason.AMPLITUDE),
        (replace(ASKED, throttle=math.nan), TripReason.AMPLITUDE),
        (replace(ASKED, throttle=OPENING + 0.007), TripReason.RATE),
        (replace(ASKED, throttle=OPENING - 0.007), TripReason.RATE),
    ],
)
def test_each_fault_of_a_throttle_command_trips_by_its_own_name(command, expected):
    assert reason(command) == expected


@pytest.mark.parametrize(
    ("spark", "expected"),
    [
        (math.radians(4.1), TripReason.RANGE),
        (math.radians(-12.1), TripReason.RANGE),
        (math.nan, TripReason.RANGE),
        (math.radians(1.01), TripReason.RATE),
    ],
)
def test_each_fault_of_a_spark_command_trips_by_its_own_name(spark, expected):
    command = replace(SPARK_ASKED, spark=spark)
    assert reason(command, granted(Authority.SPARK), SPARK_HELD) == expected


def test_the_throttle_range_holds_inside_the_allowed_deviation():
    held = replace(HELD, throttle=0.28, last=replace(BEFORE, throttle=0.3))
    assert reason(replace(ASKED, throttle=0.3002), held=held) == TripReason.RANGE


def test_the_first_command_may_not_jump_away_from_the_operating_point():
    first = replace(HELD, last=ActuatorCommand(Authority.NONE, 0.0, 0.0, NOW - 0.001))
    assert reason(held=first) is None
    assert reason(replace(ASKED, throttle=OPENING + 0.01), held=first) == TripReason.RATE


def test_after_a_late_tick_the_rate_is_judged_over_the_time_that_passed():
    late = replace(HELD, last=replace(BEFORE, time=NOW - 0.01))
    assert reason(replace(ASKED, throttle=OPENING + 0.005), held=late) is None


def test_the_devices_have_the_silence_time_to_grant_authority():
    asked_now = replace(HELD, asked_since=NOW - 0.019)
    refused = granted(Authority.NONE)
    assert reason(sight=refused, held=asked_now) is None
    assert reason(sight=refused) == TripReason.AUTHORITY_LOST


number = st.floats(allow_nan=True, allow_infinity=True)


@given(number, number, st.sampled_from([Authority.THROTTLE, Authority.SPARK, Authority.BOTH]))
def test_whatever_passes_lies_within_every_limit(throttle, spark, authority):
    command = ActuatorCommand(authority, throttle, spark, NOW)
    held = replace(HELD, last=replace(BEFORE, authority=authority))
    answer = permit(command, held, granted(authority), LIMITS, SILENCE)
    if isinstance(answer, Trip):
        return
    assert answer is command
    if authority & Authority.THROTTLE:
        assert LIMITS.throttle[0] - 1e-6 <= throttle <= LIMITS.throttle[1] + 1e-6
        assert abs(throttle - OPENING) <= LIMITS.throttle_rate * 0.001 + 1e-6
    if authority & Authority.SPARK:
        assert LIMITS.spark[0] - 1e-6 <= spark <= LIMITS.spark[1] + 1e-6
        assert abs(spark) <= LIMITS.spark_rate * 0.001 + 1e-6
