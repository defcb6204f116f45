"""Laws of a wheel's tooth pattern: detected where it exists, and not elsewhere."""

import numpy as np
import pytest

from slipbench.identification.mismatch.systems.turn_pattern import find
from slipbench.plant.signals import Floats

PERIOD = 0.02  # s
ROLL = 1.97  # m a turn


def ridden(seed: int, share: float, noise: float = 0.02) -> tuple[Floats, Floats, Floats]:
    """Time, speed as read, and speed of the wheel; 20 s about 30 m/s."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    time = PERIOD * np.arange(1000)
    speed = 30.0 + 2.0 * np.sin(0.4 * time)
    way = 30.0 * time + 5.0 * (1.0 - np.cos(0.4 * time))
    reading = speed * (1.0 + share * np.cos(2 * np.pi * way / ROLL + rng.uniform(0.0, 6.28)))
    return time, reading + noise * rng.standard_normal(time.size), speed


@pytest.mark.parametrize("seed", [31, 32])
@pytest.mark.parametrize("share", [0.0005, 0.002])
def test_a_pattern_is_found_with_its_roll_and_taken_out(seed: int, share: float) -> None:
    time, reading, speed = ridden(seed, share)
    found = find(time, reading, 2.0, 0.1)
    assert found is not None
    assert found.roll == pytest.approx(ROLL, rel=2e-3)
    assert abs(found.swing) == pytest.approx(share, rel=0.2)
    way = np.concatenate(([0.0], np.cumsum(0.5 * (reading[1:] + reading[:-1]) * PERIOD)))
    remainder = reading - found.course(reading, way) - speed
    assert np.std(remainder) < 0.5 * np.std(reading - speed) + 0.02


def test_noise_has_no_pattern() -> None:
    found = [find(*ridden(seed, 0.0)[:2], 2.0, 0.1) for seed in range(40, 60)]
    assert sum(f is not None for f in found) <= 2


def test_motion_that_is_no_turn_of_this_wheel_stays() -> None:
    time, reading, _ = ridden(61, 0.002)
    assert find(time, reading, 2.4, 0.1) is None


def test_few_samples_a_turn_tell_nothing() -> None:
    time, reading, _ = ridden(62, 0.002)
    assert find(time[::3], reading[::3], 2.0, 0.1) is None
