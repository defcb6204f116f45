"""Slip as it can be known online: right at every speed, steady where a sensor is lost."""

import math

import numpy as np
import pytest

from slipbench.controllers.slip_estimator import SlipEstimator

TEETH, REAR, FRONT = 16, 0.32, 0.30
ESTIMATOR = SlipEstimator(TEETH, REAR, FRONT)


def ride(v, slip, seconds, lost=(math.inf, math.inf), scale=1.0, displaced=0.0):
    """Steady ride: returns times and slips every ms. scale: true over front wheel's speed."""
    state = ESTIMATOR.initial()
    events = []
    shift = np.zeros(TEETH)
    shift[5] = displaced
    for wheel, speed in ((0, v * (1 + slip) / REAR), (1, v / scale / FRONT)):
        pitch = 2 * math.pi / TEETH
        n = np.arange(round(seconds * speed / pitch))
        times = (n * pitch + (shift[n % TEETH] if wheel == 0 else 0.0)) / speed
        events += [(t, wheel, float(k)) for k, t in zip(n, np.round(times, 6), strict=True)]
    events += [(t, 2, v) for t in np.arange(0, seconds, 0.004) if not lost[0] <= t < lost[1]]
    events += [(t, 3, 0.0) for t in np.arange(0.1, seconds, 0.001)]
    found = []
    for t, kind, value in sorted(events):
        if kind == 0:
            state = ESTIMATOR.rear_tooth(state, t, value)
        elif kind == 1:
            state = ESTIMATOR.front_tooth(state, t, value)
        elif kind == 2:
            state = ESTIMATOR.optical(state, t, value)
        else:
            found.append((t, ESTIMATOR.slip(state, t)))
    return found


@pytest.mark.parametrize("v", [10.0, 30.0, 53.0])
@pytest.mark.parametrize("slip", [-0.02, 0.0, 0.015, 0.1])
def test_a_steady_slip_is_seen_as_it_is(v, slip):
    seen = [s.value for t, s in ride(v, slip, 1.0) if t < 0.97]
    timer = 2e-6 * v / (2 * math.pi * REAR / TEETH)
    assert max(abs(x - slip) for x in seen) < 1.5 * timer + 1e-9


def test_its_age_is_between_half_and_one_and_a_half_intervals():
    interval = 2 * math.pi * REAR / TEETH / 53.0
    ages = np.array([s.age for _, s in ride(53.0, 0.0, 1.0)])
    assert ages.min() >= 0.45 * interval
    assert ages.max() <= 1.55 * interval
    assert ages.mean() == pytest.approx(interval, rel=0.1)


def test_a_lost_optical_sensor_changes_nothing_but_the_source():
    """The front wheel rolls 1 % smaller than believed: that is learnt before it is needed."""
    found = ride(40.0, 0.02, 16.0, lost=(12.0, 14.0), scale=0.99)
    late = [(t, s) for t, s in found if t > 11.0]
    assert {s.source for _, s in late} == {"optical", "front wheel"}
    assert all(s.source == "front wheel" for t, s in late if 12.02 < t < 13.99)
    assert max(abs(s.value - 0.02) for _, s in late) < 5e-4


def test_a_displaced_tooth_is_learnt_away():
    found = ride(40.0, 0.01, 20.0, displaced=0.03)
    first = max(abs(s.value - 0.01) for t, s in found if t < 1.0)
    late = max(abs(s.value - 0.01) for t, s in found if t > 15.0)
    assert first > 0.05
    assert late < 0.1 * first


@pytest.mark.parametrize("silence", [0.004, 0.02, 0.1])
def test_a_wheel_whose_teeth_fail_to_come_is_not_taken_for_a_slow_one(silence):
    """It would open the throttle: what is not known is held."""
    state = ESTIMATOR.initial()
    for k in range(40):
        state = ESTIMATOR.rear_tooth(state, 0.0025 * k, float(k))
    last = 0.0025 * 39
    state = ESTIMATOR.optical(state, last + silence, 50.0)
    known = silence < 1.5 * 0.0025
    assert math.isfinite(ESTIMATOR.slip(state, last + silence).value) == known
    late = SlipEstimator(TEETH, REAR, FRONT, report=0.0065)
    known = silence < 1.5 * 0.0025 + 0.0065
    assert math.isfinite(late.slip(state, last + silence).value) == known


@pytest.mark.parametrize(("slip", "known"), [(-0.02, True), (-0.05, False), (0.5, True)])
def test_a_slip_that_no_engine_makes_is_unknown(slip, known):
    found = [s.value for t, s in ride(50.0, slip, 0.5) if t < 0.45]
    assert np.isfinite(found).all() == known
    assert np.isfinite(found).any() == known


def test_nothing_known_is_told_as_nan():
    slip = ESTIMATOR.slip(ESTIMATOR.initial(), 1.0)
    assert math.isnan(slip.value)
    assert slip.source == "unknown"
