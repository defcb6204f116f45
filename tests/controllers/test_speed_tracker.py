"""A tracked speed: no lag where the motorcycle speeds up, less noise, nothing left of before."""

import math

import numpy as np
import pytest

from slipbench.controllers.speed_tracker import SpeedTracker, Track

PERIOD = 0.004
TRACKER = SpeedTracker()


def tracked(readings, tracker=TRACKER):
    track, found = Track(), []
    for k, z in enumerate(readings):
        track = tracker.update(track, k * PERIOD, float(z))
        found.append(track)
    return found


@pytest.mark.parametrize("slope", [-8.0, 0.0, 5.0])
def test_a_steady_acceleration_costs_no_lag(slope):
    t = np.arange(500) * PERIOD
    found = tracked(30.0 + slope * t)
    assert found[-1].speed == pytest.approx(30.0 + slope * t[-1], abs=1e-9)
    assert found[-1].at(t[-1] + 0.003) == pytest.approx(30.0 + slope * (t[-1] + 0.003), abs=1e-9)


def test_noise_is_as_small_as_the_theory_of_such_filters_says():
    """Critically damped: (1 - theta) (5 + 4 theta + theta^2) / (1 + theta)^3 of the variance."""
    print("seed 3")
    noise = 0.02 * np.random.default_rng(3).standard_normal(40_000)
    late = np.array([t.speed for t in tracked(50.0 + noise)])[1000:]
    theta = math.exp(-PERIOD / TRACKER.memory)
    share = (1 - theta) * (5 + 4 * theta + theta**2) / (1 + theta) ** 3
    assert late.std() == pytest.approx(0.02 * math.sqrt(share), rel=0.1)
    assert late.std() < 0.006


def test_after_a_silence_nothing_of_before_is_left():
    track = tracked(np.full(100, 50.0))[-1]
    again = TRACKER.update(track, track.time + 0.5, 20.0)
    assert again == Track(20.0, 0.0, track.time + 0.5, 1)
