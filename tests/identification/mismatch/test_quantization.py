"""Laws of quantization: the grid is estimated from values; rounding has an expected value."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from slipbench.identification.mismatch.simulation.quantization import fit_quantization
from slipbench.plant.channels import mean_quantised

seeds = st.integers(0, 2**32 - 1)


def wandering(seed: int, size: int = 4000) -> np.ndarray:
    """A random walk over many units with a large offset."""
    rng = np.random.default_rng(seed)
    return 700.0 + np.cumsum(rng.standard_normal(size))


@settings(deadline=None)
@given(st.floats(0.5, 3.0), st.floats(-0.5, 0.5), seeds)
def test_step_and_phase_are_recovered(step, phase, seed):
    waveform = wandering(seed)
    quantized = step * np.round(waveform / step - phase) + step * phase
    found = fit_quantization(quantized)
    assert found.step == pytest.approx(step, rel=1e-9)
    assert (quantized - found.phase) / found.step == pytest.approx(
        np.round((quantized - found.phase) / found.step), abs=1e-6
    )


@settings(deadline=None)
@given(st.floats(1.0, 8.0), seeds)
def test_a_finer_rounding_after_it_hides_no_step(step, seed):
    """A byte on an inner bus, forwarded with the finer steps of the outer bus."""
    fine = 0.05
    waveform = 20.0 * wandering(seed) / 10.0
    quantized = fine * np.round(step * np.round(waveform / step) / fine)
    found = fit_quantization(quantized)
    levels = (quantized - found.phase) / found.step
    assert np.abs(levels - np.round(levels)).max() * step < 1.5 * fine


@given(seeds)
def test_what_is_continuous_has_no_steps(seed):
    assert fit_quantization(wandering(seed)).step == 0.0


@pytest.mark.parametrize("values", [[], [1.0], [2.0] * 500])
def test_what_does_not_move_has_no_steps(values):
    assert fit_quantization(np.array(values)).step == 0.0


@pytest.mark.parametrize("noise", [0.1, 0.2, 0.35])
@pytest.mark.parametrize("phase", [0.0, 0.3])
def test_the_mean_of_what_is_told_is_that_of_many_draws(noise, phase):
    rng = np.random.default_rng(3)
    values = np.linspace(-2.0, 2.0, 41)
    drawn = values[:, None] + noise * rng.standard_normal((41, 40000))
    quantized = np.round(drawn - phase) + phase
    expected = mean_quantised(values, 1.0, noise, phase, least=0.05)
    assert expected == pytest.approx(quantized.mean(axis=1), abs=0.01)


def test_steps_break_a_promise_only_where_there_is_one_and_they_are_coarser():
    found = fit_quantization(np.round(wandering(1) / 2.0) * 2.0)
    assert found.coarser_than(0.5)
    assert not found.coarser_than(0.0)
    assert not found.coarser_than(2.0)
