"""Curves are detected in any units, and once for equal quantities."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench.identification.mismatch.curves.scan import RIDGE, _cross_predicted, _solved
from slipbench.identification.mismatch.simulation.regressor import quantity_of, with_kinds
from slipbench.identification.mismatch.systems.system import first_of_each_waveform


@given(st.integers(0, 2**32 - 1), st.floats(-3.0, 12.0))
def test_dependent_columns_of_any_size_have_a_solution(seed, exponent):
    """As where a system offset equals the sum of the knots and is projected out."""
    rng = np.random.default_rng(seed)
    columns = 10.0**exponent * rng.standard_normal((200, 6))
    columns[:, 5] = columns[:, :5].sum(axis=1)
    residuals = rng.standard_normal(200)
    solution = _solved(columns.T @ columns, columns.T @ residuals, columns)
    best = columns @ np.linalg.lstsq(columns, residuals, rcond=1e-9)[0]
    shrunk = RIDGE / (RIDGE + 10.0 ** (2.0 * exponent) * 50.0)  # by the ridge, if columns are small
    explained = columns @ solution
    assert np.all(np.isfinite(solution))
    assert np.linalg.norm(explained - best) <= (shrunk + 1e-3) * np.linalg.norm(best)
    predicted = _cross_predicted(columns, residuals, np.arange(200) // 10)
    assert np.all(np.isfinite(predicted))


WAVES = {"a": [1.0, 2.0], "b": [1.0, 2.0], "c": [2.0, 1.0], "d": [2.0, 1.0], "e": [0.0, 0.0]}


def test_quantities_with_the_same_waveform_are_one():
    waves = {name: np.array(wave) for name, wave in WAVES.items()}
    assert first_of_each_waveform(waves) == {"a": "a", "b": "a", "c": "c", "d": "c", "e": "e"}


@pytest.mark.parametrize("missing", ["a", "b"])
def test_regressors_of_a_quantity_that_is_not_recorded_are_left_out(missing):
    waves = {name: np.array(WAVES[name]) for name in "ab" if name != missing}
    found = with_kinds(waves, "ab", "ab", "ab", [("a", "b"), ("b", "a")])
    assert {quantity_of(name) for name in found} == set(waves)
    assert len(found) == 4
