"""A drum turned by a drive: recordings with known truth, independent integrator.

v' = torque + hidden torque over angle, torque = gain drive - damping v, each over the inertia. The
numbers of the nominal model are off by some per cent. Held drive, the midpoint rule at a tenth of the
sampling period. An encoder shows the angle, or a tachometer the speed; then no channel has the
angle at the start of a recording.
"""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source

PERIOD = 0.005  # s
FINER = 10
GAIN, DAMPING = 19.0, 1.05  # rad/s^2/V, 1/s
NOISE = {"encoder": 2e-3, "tacho": 0.02}  # rad, rad/s
MODEL = """
name = "Drum"
step = "2.5 ms"
period = "5 ms"
stretch = "1 s"

[parameters]
gain = { value = 20, unit = "rad/s^2/V", plus_minus = 4 }
damping = { value = 1, unit = "1/s", plus_minus = 0.3 }

[inputs.drive]
role = "drive"
size = { value = 1, unit = "V" }

[states.angle]
rate = "speed"
size = { value = 6, unit = "rad" }
start = START

[states.speed]
rate = "torque"
size = { value = 20, unit = "rad/s" }

[seams.torque]
value = "gain * drive - damping * speed"
size = { value = 10, unit = "rad/s^2" }
along = "speed"
"""
OUTPUTS = {
    "encoder": """
[outputs.encoder]
role = "encoder"
value = "angle"
size = { value = 6, unit = "rad" }
""",
    "tacho": """
[outputs.tacho]
role = "tacho"
value = "speed"
size = { value = 20, unit = "rad/s" }
""",
}
ROLES = RoleMap(
    title="drum",
    quantities={"drive": "V", "encoder": "rad", "tacho": "rad/s"},
    roles={r: Source(column=r) for r in ("drive", "encoder", "tacho")},
)
Hidden = Callable[[float], float]
"""Angular acceleration at an angle, rad/s^2."""


def text_of(output: str, more: str = "") -> str:
    """Text of the nominal model with one of its outputs."""
    start = '"encoder"' if output == "encoder" else '{ value = 0, unit = "rad" }'
    return MODEL.replace("START", start) + OUTPUTS[output] + more


def drum(folder: Path, text: str) -> ModelSystem:
    """Read a model of the drum."""
    path = folder / "drum.toml"
    path.write_text(text, encoding="utf-8")
    return ModelSystem.load(path)


def orders(*parts: tuple[int, float, float]) -> Hidden:
    """Sum of lines: order, amplitude, phase."""
    return lambda angle: sum(size * math.sin(n * angle + phase) for n, size, phase in parts)


def pulses(size: float, width: float = 0.35) -> Hidden:
    """A negative pulse, followed by a positive pulse, once per turn."""

    def pulse_torque(angle: float) -> float:
        way = (angle + math.pi - 1.0) % (2.0 * math.pi) - math.pi
        down, up = (math.exp(-0.5 * ((way + by) / width) ** 2) for by in (0.45, -0.45))
        return size * (up - down)

    return pulse_torque


def turned(
    seed: int, output: str, hidden: Hidden, seconds: float = 10.0, drive: float = 0.9
) -> Recording:
    """Record the drum, begun at any angle. drive: mean, V."""
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    count = round(seconds / PERIOD)
    levels = np.repeat(rng.standard_normal(count // 40 + 1), 40)[:count]
    command, angle = drive + 0.5 * levels, float(rng.uniform(-3.0, 3.0))
    speed, h, shown = drive * GAIN / DAMPING, PERIOD / FINER, np.empty((2, count))

    def rate(angle: float, speed: float, drive: float) -> float:
        return GAIN * drive - DAMPING * speed + hidden(angle)

    for k in range(count):
        shown[:, k] = angle, speed
        for _ in range(FINER):
            half = speed + 0.5 * h * rate(angle, speed, command[k])
            gained = rate(angle + 0.5 * h * speed, half, command[k])
            angle, speed = angle + h * half, speed + h * gained
    reading = shown[0 if output == "encoder" else 1] + NOISE[output] * rng.standard_normal(count)
    time = PERIOD * np.arange(count)
    values = {"drive": command, output: reading}
    channels = {r: Channel(r, time, y, ROLES.unit(r), "bus", "made") for r, y in values.items()}
    return Recording(Path(f"drum{seed}"), {}, None, ROLES, channels, {})
