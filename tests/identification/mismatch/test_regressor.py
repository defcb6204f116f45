"""Regressors of free curves: laws of memory, hysteresis, scaling and piecewise linear curves."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.mismatch.simulation.regressor import (
    DETAIL,
    HYSTERESIS,
    LAGS,
    OVER,
    PAST,
    SCALE,
    change_after_reversal,
    columns,
    curve_waveform,
    finer,
    kind_of,
    knots_for,
    quantity_of,
    scale,
    step_response,
)

STEP = 1e-3
REGRESSORS = (
    "slip",
    f"{PAST}slip",
    f"{HYSTERESIS}slip",
    f"{DETAIL}slip",
    f"{SCALE}tyre force{OVER}slip",
)
seeds = st.integers(0, 2**31)


def walk(seed: int, rows: int = 4000) -> np.ndarray:
    """A random walk."""
    return np.cumsum(np.random.default_rng(seed).standard_normal(rows)) * 0.05


def quantities(regressor: str, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Values of a regressor, and the quantity on which its knots lie."""
    z = walk(seed)
    return (scale(walk(seed + 1), z) if kind_of(regressor) == SCALE else z), z


@pytest.mark.parametrize("regressor", REGRESSORS)
@settings(max_examples=20, deadline=None)
@given(seeds)
def test_a_course_is_the_sum_of_its_columns(regressor, seed):
    samples, z = quantities(regressor, seed)
    knots = knots_for(regressor, z)
    values = np.random.default_rng(seed).standard_normal(knots.size)
    summed = sum(
        v * c for v, c in zip(values, columns(regressor, samples, knots, STEP), strict=True)
    )
    assert curve_waveform(regressor, samples, knots, values, STEP) == pytest.approx(summed)
    assert quantity_of(regressor) == "slip"


@pytest.mark.parametrize("regressor", REGRESSORS)
def test_finer_knots_hold_the_old_ones_and_none_are_there_without_movement(regressor):
    z = walk(1)
    knots = knots_for(regressor, z)
    assert np.all(np.diff(knots) > 0.0)
    assert set(knots) <= set(finer(regressor, knots))
    assert knots_for(regressor, np.full(100, 2.0)).size == 0


@settings(max_examples=30, deadline=None)
@given(st.lists(st.floats(-5, 5), min_size=LAGS.size, max_size=LAGS.size))
def test_a_step_is_answered_as_the_step_response_tells(increments):
    values = np.array(increments)
    before, after = 3000, 3000
    z = np.concatenate((np.zeros(before), np.ones(after)))
    response = curve_waveform(f"{PAST}z", z, LAGS, values, STEP)
    response -= response[before - 1]
    time = STEP * np.arange(after)
    expected = step_response(LAGS, values, time)
    assert response[before:] == pytest.approx(expected, abs=STEP / 0.005 * 6.0)
    assert response[before + 2400 :] == pytest.approx(np.full(after - 2400, values.sum()), abs=0.01)


@settings(max_examples=30, deadline=None)
@given(seeds, st.integers(1, 300))
def test_a_past_comes_later_when_its_quantity_does(seed, rows):
    z = walk(seed)
    late = np.concatenate((np.full(rows, z[0]), z[:-rows]))
    # Each column has its mean removed, which only shifts it by a constant.
    one, other = (list(columns(f"{PAST}z", x, LAGS, STEP)) for x in (z, late))
    for a, b in zip(one, other, strict=True):
        apart = b[rows + 2500 :] - a[2500 : a.size - rows]
        assert np.ptp(apart) < 1e-9


@settings(max_examples=30, deadline=None)
@given(seeds, st.floats(0.01, 3.0))
def test_a_stop_follows_within_its_width_and_slides_beyond(seed, width):
    z = walk(seed)
    unlimited, stop = columns(f"{HYSTERESIS}z", z, np.array([0.0, width]), STEP)
    assert np.ptp(unlimited - z) == pytest.approx(0.0, abs=1e-9)
    assert np.abs(stop).max() <= width
    follows = np.diff(stop) - np.diff(z)
    inside = np.abs(stop[1:]) < width
    assert np.abs(follows[inside]).max(initial=0.0) < 1e-9


@settings(max_examples=30, deadline=None)
@given(seeds, st.integers(2, 5))
def test_hysteresis_does_not_know_how_fast_it_goes(seed, times):
    """Rate independence: the same path at a lower rate."""
    z = walk(seed, 500)
    slow = np.interp(np.arange(times * 499 + 1) / times, np.arange(500), z)
    widths = np.array([0.1, 0.5])
    for a, b in zip(
        columns(f"{HYSTERESIS}z", z, widths, STEP),
        columns(f"{HYSTERESIS}z", slow, widths, STEP),
        strict=True,
    ):
        assert b[::times] == pytest.approx(a, abs=1e-9)


def test_after_a_turn_it_changes_as_told():
    widths, values = np.array([0.0, 0.1, 0.4]), np.array([0.0, 2.0, -1.0])
    up, down = np.linspace(0.0, 3.0, 301), np.linspace(3.0, 0.0, 301)[1:]
    response = curve_waveform(f"{HYSTERESIS}z", np.concatenate((up, down)), widths, values, STEP)
    way = 3.0 - down
    assert response[300] - response[301:] == pytest.approx(
        change_after_reversal(widths, values, way), abs=1e-9
    )


@given(seeds, st.floats(-3.0, 3.0))
@settings(max_examples=20, deadline=None)
def test_a_scale_is_in_proportion_to_what_it_scales(seed, factor):
    z, x = walk(seed), walk(seed + 1)
    regressor = f"{SCALE}x{OVER}z"
    knots = knots_for(regressor, z)
    values = np.arange(float(knots.size))
    one = curve_waveform(regressor, scale(x, z), knots, values, STEP)
    other = curve_waveform(regressor, scale(factor * x, z), knots, values, STEP)
    assert other == pytest.approx(factor * one)
