"""What a ride is judged by, on rides whose figures are known."""

import math

import numpy as np
import pytest

from slipbench.identification.response.following import step_measures, tracking_bandwidth

PERIOD = 0.001
TIME = np.arange(0.0, 21.0, PERIOD)
TARGET = np.where(TIME.astype(int) % 2, 0.002, 0.001)


def second_order(target, w, damping):
    """Follow a target as w^2 / (s^2 + 2 z w s + w^2) does."""
    x, v, found = float(target[0]), 0.0, []
    for r in target:
        v += PERIOD * (w**2 * (r - x) - 2 * damping * w * v)
        x += PERIOD * v
        found.append(x)
    return np.array(found)


@pytest.mark.parametrize("damping", [0.4, 0.6])
def test_overshoot_is_the_textbooks_and_noise_does_not_raise_it(damping):
    slip = second_order(TARGET, 30.0, damping)
    exact = math.exp(-math.pi * damping / math.sqrt(1 - damping**2))
    print("seed 5")
    noise = 0.05 * 0.001 * np.random.default_rng(5).standard_normal(TIME.size)
    clean, noisy = step_measures(TARGET, slip, PERIOD), step_measures(TARGET, slip + noise, PERIOD)
    assert clean.overshoot == pytest.approx(exact, abs=0.02)
    assert noisy.overshoot == pytest.approx(exact, abs=0.05)
    assert clean.noise < 1e-6
    assert noisy.noise == pytest.approx(0.05, rel=0.1)
    assert clean.settling == pytest.approx(math.log(10) / damping / 30.0, rel=0.5)


def test_a_step_that_never_arrives_never_settles():
    assert step_measures(TARGET, np.full(TIME.size, 0.0015), PERIOD).settling == math.inf


@pytest.mark.parametrize("corner", [3.0, 6.0])
def test_a_first_order_lag_follows_to_its_corner(corner):
    swept = 0.001 * np.sin(2 * np.pi * (0.5 * TIME + 0.5 * 13.5 / 21.0 * TIME**2))
    slip = np.zeros_like(swept)
    for k in range(1, slip.size):
        slip[k] = slip[k - 1] + 2 * math.pi * corner * PERIOD * (swept[k] - slip[k - 1])
    assert tracking_bandwidth(swept, slip, 1 / PERIOD) == pytest.approx(corner, abs=0.8)
