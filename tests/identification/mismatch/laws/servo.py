"""A geared servo turns a pendulum: known truth from an independent integrator.

The nominal model has drive, damping and gravity: v' = torque, torque = gain drive - damping v -
weight sin(angle), each over the inertia. Its numbers are off by some per cent. Held drive, the
midpoint rule at a twentieth of the sampling period.
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source

PERIOD = 0.01  # s
FINER = 20
GAIN, DAMPING, WEIGHT = 19.0, 2.1, 31.0  # rad/s^2/V, 1/s, rad/s^2
NOISE = 1e-3  # rad
MODEL = """
name = "Servo with a pendulum"
step = "5 ms"
period = "10 ms"
stretch = "1 s"

[parameters]
gain = { value = 20, unit = "rad/s^2/V", plus_minus = 4 }
damping = { value = 2, unit = "1/s", plus_minus = 0.4 }
weight = { value = 30, unit = "rad/s^2", plus_minus = 6 }

[inputs.drive]
role = "drive"
size = { value = 0.6, unit = "V" }

[inputs.load]
role = "load"
size = { value = 1, unit = "N" }

[states.angle]
rate = "speed"
size = { value = 0.5, unit = "rad" }

[states.speed]
rate = "torque"
size = { value = 2, unit = "rad/s" }

[seams.torque]
value = "gain * drive - damping * speed - weight * sin(angle)"
size = { value = 10, unit = "rad/s^2" }
along = "speed"

[outputs.encoder]
role = "encoder"
value = "angle"
size = { value = 0.5, unit = "rad" }
"""
ROLES = RoleMap(
    title="servo",
    quantities={"drive": "V", "load": "N", "encoder": "rad"},
    roles={r: Source(column=r) for r in ("drive", "load", "encoder")},
)
Torque = Callable[[float, float, float, float], float]
"""Acting torque over the inertia, from nominal torque, speed, angle and the other load."""


def nothing(torque: float, speed: float, angle: float, load: float) -> float:
    """Nothing is hidden."""
    return torque


def servo(folder: Path, text: str = MODEL) -> ModelSystem:
    """Read the nominal model."""
    path = folder / "servo.toml"
    path.write_text(text, encoding="utf-8")
    return ModelSystem.load(path)


def drives(seed: int, seconds: float, size: float) -> np.ndarray:
    """Drive in volts, a value a period: levels that last 0.1 s about a slow wave."""
    rng = np.random.default_rng(1000 + seed)
    count = round(seconds / PERIOD)
    levels = np.repeat(rng.standard_normal(count // 10 + 1), 10)[:count]
    wave = np.sin(2 * np.pi * 0.4 * PERIOD * np.arange(count))
    return np.asarray(size * (levels + 0.7 * wave))


def turned(
    seed: int,
    torque: Torque = nothing,
    seconds: float = 6.0,
    noise: float = NOISE,
    size: float = 0.6,
    felt: Callable[[np.ndarray], np.ndarray] = lambda u: u,
    sensed: Callable[[np.ndarray, np.ndarray], np.ndarray] = lambda angle, load: angle,
    emf: float = 0.0,
    finer: int = FINER,
    shows: Callable[[float, float], float] = lambda angle, speed: angle,
) -> Recording:
    """Record a servo.

    felt: acting drive from the recorded drive, both with `finer` values a period; sensed: sensor
    reading. finer: steps of the integrator in a period. shows: angle or speed.
    """
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    command = drives(seed, seconds, size)
    time = PERIOD * np.arange(command.size)
    load = (
        np.sin(2 * np.pi * 0.23 * time)
        + 0.3 * np.repeat(rng.standard_normal(command.size // 25 + 1), 25)[: command.size]
    )

    def rate(angle: float, speed: float, drive: float, load: float) -> float:
        nominal = GAIN * (drive - emf * speed) - DAMPING * speed - WEIGHT * math.sin(angle)
        return torque(nominal, speed, angle, load)

    angle, speed, shown, h = 0.0, 0.0, np.empty(command.size), PERIOD / finer
    acting = felt(np.repeat(command, finer)).reshape(-1, finer)
    for k in range(command.size):
        shown[k] = shows(angle, speed)
        for drive in acting[k]:
            half = speed + 0.5 * h * rate(angle, speed, drive, load[k])
            gained = rate(angle + 0.5 * h * speed, half, drive, load[k])
            angle, speed = angle + h * half, speed + h * gained
    values = {"drive": command, "load": load, "encoder": sensed(shown, load)}
    values["encoder"] = values["encoder"] + noise * rng.standard_normal(command.size)
    channels = {r: Channel(r, time, y, ROLES.unit(r), "bus", "made") for r, y in values.items()}
    return Recording(Path(f"servo{seed}"), {}, None, ROLES, channels, {})
