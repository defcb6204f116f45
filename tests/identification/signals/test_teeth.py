"""Speed from teeth is exact when steady, bounded by the timer, and never smeared over a gap."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.signals.samples import onto
from slipbench.identification.signals.teeth import (
    delay,
    error_bound,
    speed_from_teeth,
    tooth_interval,
)
from slipbench.identification.signals.tooth_counter import resolution, teeth_per_second


def teeth_at(speed, n=400, teeth=16, radius=0.32):
    interval = tooth_interval(speed, radius, teeth)
    return np.arange(n) * interval, np.arange(n, dtype=float)


@given(speed=st.floats(1.5, 100.0), teeth=st.sampled_from([16, 32, 48]))
@settings(deadline=None)
def test_quantised_teeth_stay_within_the_error_bound(speed, teeth):
    time, count = teeth_at(speed, teeth=teeth)
    found = speed_from_teeth(np.round(time / 1e-6) * 1e-6, count, teeth)
    bound = error_bound(np.array([speed]), 0.32, teeth)[0]
    assert np.max(np.abs(found.value * 0.32 / speed - 1)) <= bound * (1 + 1e-6)


def test_sixteen_teeth_are_more_than_ten_ms_late_under_40_kmh():
    speeds = np.linspace(5, 40, 50) / 3.6
    assert np.all(delay(speeds, 0.32, 16) > 0.010)
    assert delay(np.array([40 / 3.6]), 0.32, 48)[0] < 0.004
    assert 360 * 10 * delay(np.array([40 / 3.6]), 0.32, 16)[0] > 36


def test_a_ramp_is_followed_without_delay():
    t = np.linspace(0, 5, 200_001)
    speed = 20 + 4 * t
    angle = (20 * t + 2 * t**2) / 0.3
    count = np.arange(1, int(angle[-1] * 16 / (2 * np.pi)))
    time = np.interp(count * 2 * np.pi / 16, angle, t)
    found = speed_from_teeth(time, count.astype(float), 16)
    truth = np.interp(found.time, t, speed)
    np.testing.assert_allclose(found.value * 0.3, truth, rtol=2e-5)


@given(start=st.integers(5, 380), lost=st.integers(1, 12))
@settings(max_examples=40, deadline=None)
def test_lost_teeth_leave_a_gap_and_no_smeared_speed(start, lost):
    time, count = teeth_at(30.0)
    keep = np.ones(time.size, bool)
    keep[start : start + lost] = False
    found = speed_from_teeth(time[keep], count[keep], 16)
    np.testing.assert_allclose(found.value * 0.32, 30.0, rtol=1e-9)
    inside = np.linspace(time[start - 1], time[min(start + lost, time.size - 1)], 50)[1:-1]
    assert np.all(np.isnan(onto(found, inside)))
    assert found.gap.sum() == (1 if start + lost < time.size else 0)


def test_a_wheel_that_stands_has_no_speed():
    moving, _ = teeth_at(10.0, n=100)
    again = moving[-1] + 5.0 + np.arange(1, 50) * (moving[1] - moving[0])
    time = np.concatenate((moving, again))
    found = speed_from_teeth(time, np.arange(time.size, dtype=float), 16)
    halt = np.linspace(moving[-1] + 0.5, again[0] - 0.5, 100)
    np.testing.assert_allclose(onto(found, halt), 0.0)


def test_a_repeated_tooth_changes_nothing():
    time, count = teeth_at(30.0)
    twice = np.sort(np.concatenate((np.arange(400), [100, 101, 102])))
    one, two = speed_from_teeth(time, count, 16), speed_from_teeth(time[twice], count[twice], 16)
    np.testing.assert_array_equal(one.value, two.value)


@given(rate=st.floats(20, 2000), start=st.integers(0, 255))
@settings(deadline=None)
def test_a_wrapping_counter_gives_the_rate_within_one_tooth(rate, start):
    time = np.arange(0, 10, 0.02)
    count = np.mod(np.floor(rate * time) + start, 256)
    found = teeth_per_second(time, count, 256)
    assert np.max(np.abs(found.value - rate)) <= resolution() * (1 + 1e-6)


def test_no_teeth_no_speed():
    empty = np.empty(0)
    assert speed_from_teeth(empty, empty, 16).time.size == 0
    assert np.all(np.isnan(onto(speed_from_teeth(empty, empty, 16), np.arange(3.0))))
    assert teeth_per_second(empty, empty, 256).time.size == 0
    with pytest.raises(ValueError, match="3"):
        _ = empty.reshape(3)
