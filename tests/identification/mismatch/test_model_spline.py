"""The prior of an in-model spline: a random walk over its knots."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.model_spline import increments, with_many_knots
from slipbench.plant.effects.free_curve import KNOTS


def curve(knots: np.ndarray, regressor: str = "force") -> Curve:
    values = np.zeros(knots.size)
    return Curve("place", "block", "m", regressor, knots, values, 0.0, 0.0, 1.0)


@given(st.integers(0, 2**32 - 1), st.integers(3, 40))
def test_values_between_recorded_knots_lie_on_the_line_between_them(seed, count):
    """The most likely parameters are the smallest ones."""
    rng = np.random.default_rng(seed)
    knots = np.cumsum(rng.uniform(0.01, 3.0, count))
    recorded = np.unique([0, count - 1, *rng.integers(count, size=3)])
    values = rng.standard_normal(recorded.size)
    basis = increments(curve(knots))[:, 1:]  # the first value is recorded
    parameters = np.linalg.pinv(basis[recorded]) @ (values - values[0])
    found = values[0] + basis @ parameters
    assert np.allclose(found, np.interp(knots, knots[recorded], values), atol=1e-8)


@given(st.integers(0, 2**32 - 1), st.integers(3, 60))
def test_every_curve_has_its_parameters(seed, count):
    rng = np.random.default_rng(seed)
    basis = increments(curve(np.cumsum(rng.uniform(0.01, 3.0, count))))
    values = rng.standard_normal(count)
    assert np.allclose(basis @ np.linalg.solve(basis, values), values)


@given(st.floats(1e-9, 1e9), st.floats(-1e3, 1e3))
def test_the_prior_does_not_depend_on_the_unit_of_the_regressor(unit, zero):
    knots = np.array([0.0, 0.3, 1.0, 1.7])
    assert np.allclose(increments(curve(unit * (knots + zero))), increments(curve(knots)))


def test_around_a_turn_the_parameters_are_the_values():
    knots = 2.0 * np.pi * np.arange(7) / 7
    assert np.array_equal(increments(curve(knots, "turn of angle")), np.eye(7))


@given(st.integers(2, 100))
def test_a_detailed_curve_keeps_its_knots(count):
    knots = np.linspace(-1.0, 1.0, count)
    many = with_many_knots(knots)
    assert many.size >= min(count, KNOTS)
    assert np.all(np.diff(many) > 0.0)
    if count > KNOTS:
        assert np.allclose(many[::2], knots)
