"""Residual tests reject white noise at the stated rate, and a wrong model surely."""

import numpy as np
import pytest
from scipy import signal, stats

from slipbench.identification.models.residual_tests import (
    LEVEL,
    NoTests,
    residual_tests,
    without_slow,
)
from tests.identification.response.known_lines import chain

RATE, SECONDS, BAND = 100.0, 30.0, (0.5, 12.0)
SEEDS = range(400)
TIME = np.arange(round(RATE * SECONDS)) / RATE


def swept():
    return np.sin(2 * np.pi * (BAND[0] * TIME + (BAND[1] - BAND[0]) / SECONDS * TIME**2 / 2))


def rides(u, noise):
    for seed in SEEDS:
        yield residual_tests(noise(np.random.default_rng(seed)), u, RATE, BAND)


def white(rng):
    return rng.standard_normal(TIME.size)


def drifting(rng):
    """White noise on a random walk that is large below the band and small in it."""
    return white(rng) + 0.01 * np.cumsum(rng.standard_normal(TIME.size)) + 3.0 * TIME


@pytest.mark.parametrize("noise", [white, drifting])
@pytest.mark.parametrize("excitation", ["sweep", "random"])
def test_noise_that_is_white_in_the_band_is_rejected_at_the_stated_rate(noise, excitation):
    u = swept() if excitation == "sweep" else white(np.random.default_rng(7))
    found = list(rides(u, noise))
    most = stats.binom.ppf(0.999, len(found), 2 * LEVEL)
    assert sum(not one.autocorrelation.passed for one in found) <= most
    assert sum(not one.cross_correlation.passed for one in found) <= most
    for name in ("autocorrelation", "cross_correlation"):
        above = np.mean([getattr(x, name).value > getattr(x, name).bound for x in found])
        assert above == pytest.approx(0.05, abs=0.006), name


def test_noise_with_dynamics_is_not_white_but_free_of_the_input():
    b, a = signal.butter(1, 3.0, fs=RATE)
    found = list(rides(swept(), lambda rng: signal.lfilter(b, a, white(rng))))
    assert np.mean([one.autocorrelation.passed for one in found]) < 0.01
    assert np.mean([one.cross_correlation.passed for one in found]) > 0.97


@pytest.mark.parametrize("excitation", ["sweep", "random"])
def test_a_wrong_model_is_rejected_by_the_cross_correlation(excitation):
    u = swept() if excitation == "sweep" else white(np.random.default_rng(7))
    true, wrong = (chain(delay).simulate(u, RATE) for delay in (0.010, 0.014))
    noise = 0.1 * np.std(true)
    found = list(rides(u, lambda rng: true - wrong + noise * white(rng)))
    assert not any(one.cross_correlation.passed for one in found)
    lag = found[0].cross_correlation.lag[np.argmax(found[0].cross_correlation.value)]
    assert 0 <= lag < 0.3  # the input comes first


def test_what_is_slower_than_the_band_is_taken_off_and_nothing_else():
    slow = np.cos(np.pi * 3 * (TIME + 0.5 / RATE) / SECONDS) + 0.3 * TIME
    fast = np.sin(2 * np.pi * 3.0 * TIME)
    kept = without_slow(slow + fast, RATE, BAND[0])
    assert np.std(kept - fast) < 0.03 * np.std(fast)


def test_a_record_too_short_for_the_law_is_not_tested():
    few = residual_tests(np.ones(300), np.ones(300), RATE, BAND)
    assert isinstance(few, NoTests)
    assert "lines" in few.reason
