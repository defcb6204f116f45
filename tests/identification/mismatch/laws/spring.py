"""A mass on a spring with a recorded force: known truth from an independent integrator.

The nominal model is linear: x'' = gain force - frequency^2 x - 2 damping frequency x'. Its numbers
are off by some per cent. Held force, Runge-Kutta of fourth order, a quarter of the sampling period.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source

PERIOD = 0.01  # s
FINER = 4
GAIN, FREQUENCY, DAMPING = 97.0, 10.3, 0.11
NOISE = 2e-3  # m
MODEL = """
name = "Mass on a spring"
step = "5 ms"
period = "10 ms"
stretch = "1 s"

[parameters]
gain = { value = 100, unit = "N/kg/V", plus_minus = 20 }
frequency = { value = 10, unit = "rad/s", plus_minus = 1 }
damping = { value = 0.1, unit = "1", plus_minus = 0.05 }

[inputs.force]
role = "force"
size = { value = 1, unit = "V" }

[states.position]
rate = "velocity"
size = { value = 1, unit = "m" }

[states.velocity]
rate = "gain * force - frequency ** 2 * deflection - 2 * damping * frequency * velocity"
size = { value = 10, unit = "m/s" }

[seams.deflection]
value = "position"
size = { value = 1, unit = "m" }
along = "velocity"

[outputs.place]
role = "place"
value = "position"
size = { value = 1, unit = "m" }
"""
ROLES = RoleMap(
    title="spring",
    quantities={"force": "V", "place": "m"},
    roles={r: Source(column=r) for r in ("force", "place")},
)
Spring = Callable[[float, float, float], float]


def linear(x: float, v: float, t: float) -> float:
    """Deflection that determines the spring force, m. x: m, v: m/s, t: s."""
    return x


def cubic(cube: float) -> Spring:
    """Hardening spring. cube: 1/m^2."""
    return lambda x, v, t: x + cube * x**3


def spring(folder: Path, text: str = MODEL) -> ModelSystem:
    """Read the nominal model."""
    path = folder / "spring.toml"
    path.write_text(text, encoding="utf-8")
    return ModelSystem.load(path)


def noise_of_the_force(seed: int, seconds: float, size: float = 1.0) -> np.ndarray:
    """Force that changes ten times a second, V, one value a sampling period."""
    rng = np.random.default_rng(1000 + seed)
    count = round(seconds / PERIOD)
    return np.asarray(size * np.repeat(rng.standard_normal(count // 10 + 1), 10)[:count])


def swung(
    seed: int,
    deflection: Spring = linear,
    seconds: float = 10.0,
    noise: float = NOISE,
    force: np.ndarray | None = None,
    felt: Callable[[np.ndarray], np.ndarray] = lambda u: u,
    sensed: Callable[[np.ndarray], np.ndarray] = lambda x: x,
    start: float = 0.0,
) -> Recording:
    """Record a spring.

    felt: acting force as a function of the recorded force; sensed: sensor reading; start: m.
    """
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    recorded_force = noise_of_the_force(seed, seconds) if force is None else force
    acting = felt(recorded_force)
    time = PERIOD * np.arange(recorded_force.size)
    h, stiffness, loss = PERIOD / FINER, FREQUENCY**2, 2 * DAMPING * FREQUENCY

    def rate(x: float, v: float, t: float, u: float) -> tuple[float, float]:
        return v, GAIN * u - stiffness * deflection(x, v, t) - loss * v

    x, v, shown = start, 0.0, np.empty(recorded_force.size)
    for k, u in enumerate(acting):
        shown[k] = x
        for j in range(FINER):
            t = time[k] + j * h
            a, b = rate(x, v, t, u)
            c, d = rate(x + 0.5 * h * a, v + 0.5 * h * b, t + 0.5 * h, u)
            e, f = rate(x + 0.5 * h * c, v + 0.5 * h * d, t + 0.5 * h, u)
            p, q = rate(x + h * e, v + h * f, t + h, u)
            x += h * (a + 2 * c + 2 * e + p) / 6
            v += h * (b + 2 * d + 2 * f + q) / 6
    place = sensed(shown) + noise * rng.standard_normal(recorded_force.size)
    values = {"force": recorded_force, "place": place}
    channels = {r: Channel(r, time, y, ROLES.unit(r), "bus", "made") for r, y in values.items()}
    return Recording(Path(f"spring{seed}"), {}, None, ROLES, channels, {})
