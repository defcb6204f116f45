"""A closed loop is seen and refused; an open one is not mistaken for it."""

import numpy as np
import pytest

from slipbench.identification.response.feedback import Feedback, feedback
from slipbench.identification.response.local_polynomial import sweep_response
from tests.identification.synthetic_recording import sweep

RATE = 500.0
T = np.arange(0, 30, 1 / RATE)
BAND = (0.5, 12.0)


def loop(gain, noise, seed, disturbed=0.0, late=0.0):
    """y'' + 2 z w y' + w^2 y = w^2 u behind coloured noise; u = sweep - gain y, `late` s later."""
    rng = np.random.default_rng(seed)
    w, z, h, behind = 2 * np.pi * 8, 0.3, 1 / RATE, round(late * RATE)
    r = sweep(T, T[-1]) + disturbed * np.convolve(rng.standard_normal(T.size), np.ones(25), "same")
    u, y, x, dx, v = np.zeros(T.size), np.zeros(T.size), 0.0, 0.0, 0.0
    for k in range(T.size):
        v = 0.98 * v + noise * rng.standard_normal()
        y[k] = x + v
        u[k] = r[k] - gain * (y[k - behind] if k >= behind else 0.0)
        dx += h * (w**2 * (u[k] - x) - 2 * z * w * dx)
        x += h * dx
    return u, y


def answered(u, y):
    return feedback(u, y, RATE, sweep_response(u, y, RATE, BAND))


@pytest.mark.parametrize("seed", [11, 12, 13])
@pytest.mark.parametrize(("gain", "late"), [(0.5, 0.0), (0.3, 0.03)])
def test_a_closed_loop_is_told_with_its_share(seed, gain, late):
    found = answered(*loop(gain, 0.08, seed, late=late))
    assert isinstance(found, Feedback)
    assert "closed loop" in found.reason
    assert found.correlation < -0.2  # the loop's gain is negative


@pytest.mark.parametrize("seed", range(20, 30))
def test_an_open_loop_is_not_mistaken_whatever_else_moves_the_input(seed):
    assert answered(*loop(0.0, 0.1, seed)) is None
    assert answered(*loop(0.0, 0.1, seed, disturbed=0.05)) is None


def test_a_loop_too_weak_to_matter_is_let_pass():
    assert answered(*loop(0.02, 0.05, 3)) is None
