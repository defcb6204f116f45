"""Effects with memory, effects over the angle, and sensor effects: named with magnitude.

As in test_physics.py, in the same servo, in one with a current state and in one with a
tachometer.
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from tests.identification.mismatch.laws.explained import holds, names, reported
from tests.identification.mismatch.laws.servo import MODEL, PERIOD, servo
from tests.identification.mismatch.laws.slow.test_physics import (
    STEP,
    Hidden,
    analysed,
    family,
    torque,
)
from tests.identification.mismatch.systems import plain_laws as plain

WINDOW = 62e-3  # s
Drive = Callable[[np.ndarray], np.ndarray]


def passed(law: plain.Law) -> Drive:
    """A drive that passes through a law of one quantity."""
    return lambda command: np.array([law(float(u), 0.0, STEP) for u in command])


def yielding(law: plain.Law) -> Callable[[float, float, float, float], float]:
    """A torque that passes through a law in which time does not matter."""
    return lambda nominal, speed, angle, load: law(nominal, speed, STEP)


def wound(pace: float, limit: float) -> Drive:
    """A current whose rate is limited while it follows its command: midpoint rule."""

    def felt(command: np.ndarray) -> np.ndarray:
        current, out = 0.0, np.empty(command.size)
        for k, u in enumerate(command):
            first = min(max(pace * (u - current), -limit), limit)
            middle = u - current - 0.5 * STEP * first
            rate = min(max(pace * middle, -limit), limit)
            out[k] = current + 0.5 * STEP * rate  # the mean of the step
            current += STEP * rate
        return out

    return felt


def dropped(speed: np.ndarray, load: np.ndarray) -> np.ndarray:
    """Reading of a pulse sensor with a threshold of 0.5 rad/s."""
    share = (np.abs(speed) / 0.5) ** 8
    return np.asarray(speed * share / (1.0 + share))


def held(angle: np.ndarray, load: np.ndarray) -> np.ndarray:
    """A reading that is updated at every fourth sample."""
    return np.asarray(angle[4 * (np.arange(angle.size) // 4)])


def averaged(angle: np.ndarray, load: np.ndarray) -> np.ndarray:
    """The mean of the last 62 ms; the system is at rest before the recording begins."""
    time = PERIOD * np.arange(angle.size)
    turned = CubicSpline(time, angle).antiderivative()
    since = np.maximum(time - WINDOW, 0.0)
    rested = (WINDOW - (time - since)) * angle[0]
    return np.asarray((turned(time) - turned(since) + rested) / WINDOW)


WINDING = (
    MODEL.replace("gain * drive", "gain * current").replace(
        "[inputs.drive]", 'pace = { value = 40, unit = "1/s", plus_minus = 8 }\n\n[inputs.drive]'
    )
    + """
[states.current]
rate = "pace * (drive - current)"
size = { value = 0.6, unit = "V" }
"""
)
TACHO = MODEL.replace(
    'value = "angle"\nsize = { value = 0.5, unit = "rad" }',
    'value = "speed"\nsize = { value = 2, unit = "rad/s" }',
)
HIDDEN = [
    (MODEL, Hidden("cavitation", "limit", 0.6, lambda: {"felt": lambda u: np.maximum(u, -0.6)})),
    (
        MODEL,
        Hidden(
            "many_plays", "width", 0.4, lambda: {"felt": passed(plain.plays(0.1, 0.2, 0.3, 0.4))}
        ),
    ),
    (MODEL, Hidden("bouc_wen", "share", 0.5, lambda: {"torque": yielding(plain.yields(0.5, 5.0))})),
    (
        MODEL,
        Hidden(
            "torque_ripple",
            "share",
            0.3,
            torque(lambda f, v, a, z: f * (1.0 + 0.3 * math.sin(7 * a + 0.5))),
        ),
    ),
    (
        MODEL,
        Hidden(
            "eccentricity",
            "amplitude",
            0.05,
            lambda: {"sensed": lambda angle, load: angle + 0.05 * np.sin(angle + 0.8)},
        ),
    ),
    (
        TACHO,
        Hidden(
            "low_speed_dropout",
            "threshold",
            0.5,
            lambda: {"sensed": dropped, "shows": lambda angle, speed: speed},
        ),
    ),
    (MODEL, Hidden("moving_average", "window", WINDOW, lambda: {"sensed": averaged})),
    (WINDING, Hidden("slew_limit", "limit", 10.0, lambda: {"felt": wound(38.0, 10.0)})),
]


@pytest.mark.parametrize(("text", "hidden"), HIDDEN, ids=[h.name for _, h in HIDDEN])
def test_it_is_named_and_its_size_told(tmp_path: Path, text: str, hidden: Hidden) -> None:
    found = analysed(servo(tmp_path, text), hidden.how, family(hidden.name))
    assert [n.partition(".")[0] for n in names(found)] == [hidden.name], reported(found)
    assert holds(found, hidden.name, hidden.parameter, hidden.size, slack=0.05), reported(found)
    error = found.held_out[0]
    assert error.improved < max(1.15 * error.floor, 0.02 * error.nominal), reported(found)


@pytest.mark.xfail(
    reason="a delay and a lag of the drive are named, held-out error 0.023 rad, floor 0.003: the"
    " likelihood of hold and phase has a narrow maximum that a local fit does not reach",
    run=False,  # it is known to fail
)
def test_readings_that_are_held_are_named(tmp_path: Path) -> None:
    found = analysed(servo(tmp_path, MODEL), lambda: {"sensed": held}, family("held_samples"))
    assert names(found) == ["held_samples.encoder"], reported(found)
