"""Slip is zero when the wheel rolls, does not depend on units, and is refused near standstill."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.signals.rolling_radius import rolling_ratio
from slipbench.identification.signals.slip import LEAST_SPEED, slip, slip_ratio

speeds = st.lists(st.floats(LEAST_SPEED, 100), min_size=1, max_size=50).map(np.array)


@given(speeds)
def test_a_rolling_wheel_has_no_slip(v):
    np.testing.assert_array_equal(slip_ratio(v, v), 0.0)


@given(speeds, st.floats(-0.5, 0.5), st.floats(1.0, 10.0))
def test_slip_does_not_change_when_both_speeds_are_scaled(v, ratio, scale):
    found = slip_ratio(v * (1 + ratio) * scale, v * scale)
    np.testing.assert_allclose(found, ratio, atol=1e-12)


@given(st.lists(st.floats(0, LEAST_SPEED - 0.01), min_size=1).map(np.array))
def test_slip_is_not_defined_near_standstill(v):
    assert np.all(np.isnan(slip_ratio(v + 1, v)))


def test_standing_fronts_and_spinning_rears_give_a_slip_speed_and_say_so():
    found = slip(np.linspace(0, 20, 100), np.zeros(100))
    assert found.kind == "slip speed"
    assert found.defined == 0
    assert "stand" in found.statement
    np.testing.assert_array_equal(found.speed, np.linspace(0, 20, 100))


@given(st.integers(0, 1000), st.floats(0.97, 1.03))
@settings(max_examples=25, deadline=None)
def test_the_ratio_of_rolling_radii_is_found_at_low_torque(seed, truth):
    rng = np.random.default_rng(seed)
    throttle = np.where(rng.random(5000) < 0.4, 0.02, rng.uniform(0.1, 0.8, 5000))
    v = rng.uniform(10, 40, 5000)
    driven = v * truth * (1 + 0.05 * np.maximum(throttle - 0.05, 0) + 1e-3 * rng.normal(size=5000))
    found = rolling_ratio(driven, v, throttle)
    assert found is not None
    assert abs(found.ratio - truth) < 1e-3


def test_no_radius_is_estimated_where_torque_was_never_low():
    v = np.full(1000, 30.0)
    assert rolling_ratio(v, v, np.full(1000, 0.4)) is None
    assert rolling_ratio(v, v, None) is None
