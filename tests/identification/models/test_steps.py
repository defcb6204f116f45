"""Laws of steps that are cut out of a square wave."""

from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from slipbench.identification.models.steps import NoSteps, Steps, pooled, step_responses

RATE = 1000.0


@lru_cache
def square(period=1.0, count=12, slew=20.0, shift=0.0):
    """A square wave that ends in the middle, slew-limited as the bench does it."""
    t = np.arange(round((count + 1) * period * RATE)) / RATE - shift
    target = np.where(t < count * period, np.where(np.floor(2 * t / period) % 2 == 0, 1.0, -1.0), 0)
    u, value = np.empty_like(target), 0.0
    for k, aim in enumerate(target):
        value += np.clip(aim - value, -slew / RATE, slew / RATE)
        u[k] = value
    return u


def lagged(u, lag):
    keep = np.exp(-1 / RATE / lag)
    return signal.lfilter([1 - keep], [1, -keep], u)


@given(
    offset=st.floats(-5, 5),
    gain=st.floats(0.01, 100),
    level=st.floats(-1, 1),
    slope=st.floats(-1, 1),
)
@settings(max_examples=25, deadline=None)
def test_steps_do_not_depend_on_where_the_signals_rest(offset, gain, level, slope):
    """The command's operating point and unit, and the output's level, fall out."""
    u = square()
    y = lagged(u, 0.03)
    one = step_responses(u, y, RATE)
    drift = level + slope * np.arange(u.size) / u.size * 1e-9
    other = step_responses(offset + gain * u, gain * y + drift, RATE)
    assert isinstance(one, Steps)
    assert isinstance(other, Steps)
    assert other.opening.size == pytest.approx(gain * one.opening.size, rel=1e-6)
    assert np.allclose(other.opening.mean, gain * one.opening.mean, atol=1e-6 * gain + 1e-8)


def test_a_linear_system_opens_as_it_closes():
    u = square(slew=1000.0)
    steps = step_responses(u, lagged(u, 0.03), RATE)
    assert isinstance(steps, Steps)
    assert np.allclose(steps.opening.mean, -steps.closing.mean, atol=1e-6)
    assert steps.opening.size == pytest.approx(2.0)
    at = np.interp(1 - np.exp(-1), steps.opening.mean / 2, steps.time)
    assert at == pytest.approx(0.03, abs=2e-3)


def test_time_zero_is_where_the_command_passes_its_middle_between_samples_too():
    """Wherever in a sample the edge lies, the mean command is at half height at time zero."""
    rng = np.random.default_rng(1)
    u = np.concatenate(
        [square(period=1.0 + 1e-4 * rng.integers(-9, 9), count=1)[:1000] for _ in range(12)]
    )
    steps = step_responses(u, u, RATE)
    assert isinstance(steps, Steps)
    middle = np.interp(0.0, steps.time, steps.opening.mean)
    assert middle == pytest.approx(steps.opening.size / 2, abs=0.011)


def test_the_scatter_of_the_mean_is_that_of_white_noise_over_the_root_of_the_count():
    ratios = []
    for seed in range(8):
        u = square(count=24)
        noise = 0.1 * np.random.default_rng(seed).standard_normal(u.size)
        steps = step_responses(u, lagged(u, 0.03) + noise, RATE)
        assert isinstance(steps, Steps)
        expected = 0.1 / np.sqrt(len(steps.opening.output))
        ratios.append(np.median(steps.opening.deviation) / expected)
    print("seeds 0..7:", ratios)
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.15)


@pytest.mark.parametrize(
    ("u", "word"),
    [(square(count=3), "at least"), (square(period=0.3), "s between steps"), (np.zeros(5000), "0")],
)
def test_what_holds_no_steps_is_refused_in_words(u, word):
    found = step_responses(u, u, RATE)
    assert isinstance(found, NoSteps)
    assert word in found.reason


def test_pooled_steps_are_the_steps_of_both():
    steps = step_responses(square(), lagged(square(), 0.03), RATE)
    assert isinstance(steps, Steps)
    both = pooled([steps, steps])
    assert len(both.opening.output) == 2 * len(steps.opening.output)
    assert np.allclose(both.opening.mean, steps.opening.mean)
