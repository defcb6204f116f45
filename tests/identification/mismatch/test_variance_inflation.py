"""Significance of an amplitude: its error rate holds, also for serially correlated errors."""

import numpy as np
import pytest

from slipbench.identification.mismatch.fit.variance_inflation import (
    VarianceInflation,
    amplitude_p,
    fit_variance_inflation,
)

STRETCHES, LENGTH = 16, 200
GROUPS = np.repeat(np.arange(STRETCHES), LENGTH)


def noise(rng, shared):
    """White noise with a part that is common to each segment."""
    common = np.repeat(rng.standard_normal(STRETCHES), LENGTH)
    return rng.standard_normal(STRETCHES * LENGTH) + shared * common


def smooth(rng):
    return np.convolve(rng.standard_normal(STRETCHES * LENGTH), np.ones(20) / 20, "same")


@pytest.mark.parametrize("shared", [0.0, 0.3])
def test_false_alarms_are_as_rare_as_the_level(shared):
    rng = np.random.default_rng(3)
    print("seed 3")
    alarms = 0
    for _ in range(60):
        residuals = noise(rng, shared)
        usual = fit_variance_inflation(
            np.stack([smooth(rng) for _ in range(12)], axis=1), residuals, GROUPS
        )
        alarms += sum(amplitude_p(smooth(rng), residuals, GROUPS, usual) < 0.05 for _ in range(10))
    assert alarms < 0.08 * 600


def test_a_course_that_is_there_is_found_and_one_too_small_does_not_count():
    rng = np.random.default_rng(4)
    waveform = smooth(rng)
    residuals = noise(rng, 0.0) + waveform
    assert amplitude_p(waveform, residuals, GROUPS, VarianceInflation()) < 1e-6
    assert amplitude_p(waveform, residuals, GROUPS, VarianceInflation(), least=2.0) > 0.99


def test_a_course_in_one_stretch_borrows_what_is_usual():
    rng = np.random.default_rng(5)
    waveform = smooth(rng) * (GROUPS == 3)
    residuals = noise(rng, 0.0) + 4.0 * waveform
    assert amplitude_p(waveform, residuals, GROUPS, VarianceInflation(1.0, 30.0)) < 1e-4
