"""Laws of the static tyre force and of its departures from the formula."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.plant.equations import tyre_force

GRIP, LOAD, STIFFNESS, SHAPE = 1.25, 1350.0, 45e3, 1.55
PEAK = GRIP * LOAD
PLACES = (*range(1, 9), 12)
departures = st.lists(st.floats(-0.3, 0.3), min_size=9, max_size=9)


def slip_at(eighths: float) -> float:
    """Slip at which the slope at zero slip alone would give so many eighths of the peak."""
    return eighths / 8.0 * PEAK / STIFFNESS


def force_at(eighths: float, forms: list[float]) -> float:
    return tyre_force(slip_at(eighths), GRIP, LOAD, LOAD, STIFFNESS, SHAPE, *forms)


@given(departures)
def test_the_force_departs_by_each_value_at_its_place(forms: list[float]) -> None:
    for place, form in zip(PLACES, forms, strict=True):
        B = STIFFNESS / (SHAPE * PEAK)
        formula = PEAK * math.sin(SHAPE * math.atan(B * slip_at(place)))
        assert force_at(place, forms) - formula == pytest.approx(form * PEAK, abs=1e-9 * PEAK)


@given(departures, st.sampled_from([0, *range(1, 13)]))
def test_the_slope_of_the_force_has_no_step_at_a_place(forms: list[float], place: int) -> None:
    """A step of the slope that moves with the peak makes several minima of a calibration."""
    step = 1e-5
    below, at, above = (force_at(place + s, forms) for s in (-step, 0.0, step))
    assert abs(above - 2.0 * at + below) / step < 1e-3 * PEAK


@given(departures, st.floats(0.0, 40.0))
def test_the_force_is_odd_and_stays_near_the_formula(forms: list[float], eighths: float) -> None:
    force, formula = force_at(eighths, forms), force_at(eighths, [0.0] * 9)
    assert force_at(-eighths, forms) == -force
    largest = max(abs(f) for f in forms)
    assert abs(force - formula) <= 1.3 * largest * PEAK + 1e-9
