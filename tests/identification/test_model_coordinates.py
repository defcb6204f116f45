"""What the parameters of a model file must keep to when recordings pull at them."""

import math

import numpy as np
import pytest

from identification.mismatch.coordinates import Coordinate
from identification.mismatch.systems.coordinates import REACH, Believed

TOLD = [("parameters", "gain", 1.5, 0.3, False), ("parameters", "offset", -0.2, 0.1, True)]


@pytest.mark.parametrize("told", TOLD)
def test_whatever_pulls_a_parameter_stays_within_what_was_believed(told):
    plain, kept = Coordinate(*told), Believed(*told)
    ends = sorted((plain.at(-REACH), plain.at(REACH)))
    pulled = [kept.at(x) for x in (-1e6, -40.0, -3.0, 0.0, 3.0, 40.0, 1e6)]
    assert all(ends[0] - 1e-12 <= value <= ends[1] + 1e-12 for value in pulled)
    assert (np.diff(pulled) >= 0.0).all()


@pytest.mark.parametrize("told", TOLD)
@pytest.mark.parametrize("x", [-4.0, -0.5, 0.0, 0.5, 2.0])
def test_the_slope_is_that_of_the_value(told, x):
    kept = Believed(*told)
    assert kept.slope(x) == pytest.approx((kept.at(x + 1e-5) - kept.at(x - 1e-5)) / 2e-5, rel=1e-4)


@pytest.mark.parametrize("told", TOLD)
def test_within_a_deviation_it_is_hardly_held(told):
    plain, kept = Coordinate(*told), Believed(*told)
    moved = abs(plain.at(1.0) - plain.at(0.0))
    assert math.isclose(plain.at(1.0), kept.at(1.0), abs_tol=0.05 * moved)
