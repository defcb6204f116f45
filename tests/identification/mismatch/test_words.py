"""The description of a curve's shape is independent of its size and states units."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.words import shape_in_words
from slipbench.identification.mismatch.simulation.regressor import HYSTERESIS, KINDS, PAST

Z = np.linspace(-1.0, 1.0, 9)
SHAPES = {
    "linear": 2.0 * Z,
    "a dead zone": np.sign(Z) * np.maximum(np.abs(Z) - 0.5, 0.0),
    "a step at zero": np.tanh(10.0 * Z),
    "the same for both signs": Z**2,
    "a different slope for each sign": np.where(Z > 0.0, 3.0 * Z, Z),
}


def curve(values, knots=Z, regressor="twist"):
    return Curve("driveline torque", "driveline", "N m", regressor, knots, values, 1, 1, 0.0)


@pytest.mark.parametrize("said", SHAPES)
@pytest.mark.parametrize("size", [1e-3, 1.0, -40.0])
def test_a_shape_is_the_same_at_any_size(said, size):
    assert said in shape_in_words(curve(size * SHAPES[said]), "rad")


@pytest.mark.parametrize("slope", [-2.0, 0.0, 0.5])
def test_a_bump_is_told_off_its_straight_line_with_the_unit_of_its_place(slope):
    z = np.linspace(100.0, 200.0, 11)
    bump = 30.0 * np.exp(-(((z - 140.0) / 10.0) ** 2))
    description = shape_in_words(
        curve(bump + 0.1 * slope * (z - 100.0), z, "engine speed"), "rad/s"
    )
    assert description == "a local bump or dip about 140 rad/s"


@pytest.mark.parametrize("knots", [Z, Z + 2.0, Z - 0.3])
@pytest.mark.parametrize(
    ("values", "said"),
    [
        (3.0 + 0.2 * Z, "a constant gain"),
        (0.5 * Z, "linear"),
        (np.abs(Z) < 0.1, "a local bump or dip about"),
    ],
)
def test_a_gain_is_told_wherever_its_quantity_has_its_nought(knots, values, said):
    scaled = curve(1.0 * values, knots, "scale of air along spark")
    assert shape_in_words(scaled, "rad").startswith(said)


@settings(deadline=None)
@given(
    st.sampled_from(("", *KINDS)),
    st.integers(2, 12).flatmap(
        lambda n: st.tuples(
            st.lists(st.floats(-3.0, 3.0), min_size=n, max_size=n),
            st.lists(st.floats(0.01, 1.0), min_size=n, max_size=n),
        )
    ),
    st.floats(-3.0, 1.0),
)
def test_every_kind_of_curve_has_words(kind, drawn, first):
    values, apart = map(np.array, drawn)
    of_lags = kind in (PAST, HYSTERESIS)
    knots = np.cumsum(apart) - apart[0] + (0.0 if of_lags else first)
    assert shape_in_words(curve(values, knots, f"{kind}twist"), "rad")


def test_a_hysteresis_tells_the_way_that_a_turn_takes():
    widths = np.array((0.0, 0.01, 0.05, 0.2))
    values = np.array((1.0, 0.1, 300.0, 0.1))
    description = shape_in_words(curve(values, widths, "hysteresis of twist"), "rad")
    assert description.endswith("width after a reversal 0.1 rad")
    assert shape_in_words(curve(values, widths, "hysteresis of slip"), "1").endswith("0.1")
