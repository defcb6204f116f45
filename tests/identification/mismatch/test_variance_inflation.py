"""How certain an amplitude is: as often wrong as it says, also where errors hang together."""

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
    """White noise with a part that each stretch has in common."""
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
        left = noise(rng, shared)
        usual = fit_variance_inflation(
            np.stack([smooth(rng) for _ in range(12)], axis=1), left, GROUPS
        )
        alarms += sum(amplitude_p(smooth(rng), left, GROUPS, usual) < 0.05 for _ in range(10))
    assert alarms < 0.08 * 600


def test_a_course_that_is_there_is_found_and_one_too_small_does_not_count():
    rng = np.random.default_rng(4)
    course = smooth(rng)
    left = noise(rng, 0.0) + course
    assert amplitude_p(course, left, GROUPS, VarianceInflation()) < 1e-6
    assert amplitude_p(course, left, GROUPS, VarianceInflation(), least=2.0) > 0.99


def test_a_course_in_one_stretch_borrows_what_is_usual():
    rng = np.random.default_rng(5)
    course = smooth(rng) * (GROUPS == 3)
    left = noise(rng, 0.0) + 4.0 * course
    assert amplitude_p(course, left, GROUPS, VarianceInflation(1.0, 30.0)) < 1e-4
