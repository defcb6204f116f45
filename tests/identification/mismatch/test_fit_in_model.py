"""Start points of a free curve's fit, and held-out evidence for its significance."""

from types import SimpleNamespace

import numpy as np
import pytest

from slipbench.identification.mismatch.curves import fit_in_model, locate
from slipbench.identification.mismatch.fit.variance_inflation import VarianceInflation
from tests.identification.mismatch.test_fits import LATE, calibrated

ROWS, STRETCH = 4000, 100


def numbers(fit):
    return np.array(
        [x for x, k in zip(fit.point.x, fit.model.known, strict=True) if not k.of_clock]
    )


def clocks(fit):
    return np.array([x for x, k in zip(fit.point.x, fit.model.known, strict=True) if k.of_clock])


@pytest.mark.parametrize("seed", [1, 2])
def test_a_curve_is_fitted_beside_the_numbers_of_the_file_too_if_calibration_went_astray(seed):
    base = calibrated(seed, LATE)
    here, there = fit_in_model._starts(base)
    assert here is base
    assert np.all(numbers(there) == 0.0)
    assert np.array_equal(clocks(there), clocks(base))


def test_where_calibration_did_not_go_astray_there_is_one_start():
    base = calibrated(1, 0.0)
    assert list(fit_in_model._starts(base)) == [base]


def judged(residuals, seed=0):
    groups = np.repeat(np.arange(ROWS // STRETCH), STRETCH)
    return SimpleNamespace(
        residuals=residuals,
        clusters=groups,
        fit=SimpleNamespace(variance_inflation=VarianceInflation(1.0, 30.0)),
    )


def doubts(seed, shows, amplitude):
    """p with held-out data. shows: nats of the full curve; amplitude: share that is present."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    wave = rng.standard_normal(ROWS)
    waveform = wave * np.sqrt(2.0 * 12.0 / (wave @ wave))
    expected = wave * np.sqrt(2.0 * shows / (wave @ wave))
    noise = rng.standard_normal((2, ROWS))
    noise -= np.outer(noise @ wave, wave) / (wave @ wave)  # noise orthogonal to the waveform
    training, held_out = judged(noise[0] + waveform), judged(noise[1] + amplitude * expected)
    gain = amplitude * 2.0 * shows - shows
    held = locate._Held(gain, shows, expected)
    place = SimpleNamespace(negligible=0.0, size=1.0)
    found = SimpleNamespace(place=place, half_range=1.0, cross_predicted=waveform)
    return locate._p(found, held, training, held_out)


@pytest.mark.parametrize("seed", range(3))
def test_held_out_recordings_that_show_little_weigh_what_they_show(seed):
    """Regression: held-out evidence of 27 nats did not count, since 4.7 were expected."""
    alone = doubts(seed, 0.0, 1.0)
    assert doubts(seed, 1.0, 1.0) < alone
    assert doubts(seed, 4.5, 1.0) < doubts(seed, 1.0, 1.0)
    assert doubts(seed, 4.5, 2.0) < doubts(seed, 4.5, 1.0)
    assert doubts(seed, 4.5, -0.5) > alone


@pytest.mark.parametrize("seed", range(3))
def test_held_out_recordings_that_would_show_it_plainly_can_contradict_it(seed):
    assert doubts(seed, 8.0, 0.2) == 1.0
    assert doubts(seed, 8.0, 1.0) < 1.0
