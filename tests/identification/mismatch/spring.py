"""A mass on a spring, from a model file, with recordings from an independent integrator."""

from pathlib import Path

import numpy as np
from scipy import integrate

from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source

PERIOD = 0.01  # s
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

[inputs.tilt]
role = "tilt"
size = { value = 0.5, unit = "rad" }

[states.position]
rate = "velocity"
size = { value = 1, unit = "m" }
overflows_into = "position"

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
    quantities={"force": "V", "tilt": "rad", "place": "m"},
    roles={r: Source(column=r) for r in ("force", "tilt", "place")},
)


def system(folder: Path) -> ModelSystem:
    path = folder / "spring.toml"
    path.write_text(MODEL, encoding="utf-8")
    return ModelSystem.load(path)


def recorded(
    seed: int,
    cube: float = 0.0,
    seconds: float = 20.0,
    noise: float = 2e-3,
    square: float = 0.0,
    released: float = 0.0,
) -> Recording:
    """Ride through noise of 1 V rms, held. Numbers err by per cent.

    cube, square: of the spring, 1/m^2 and 1/m; noise: of the reading, m. released: m, from where
    it oscillates freely instead, with every input at zero.
    """
    print(f"seed {seed}")
    rng = np.random.default_rng(seed)
    time = PERIOD * np.arange(round(seconds / PERIOD))
    force = np.repeat(rng.standard_normal(time.size // 10 + 1), 10)[: time.size]
    tilt = 0.5 * np.sin(2 * np.pi * 0.3 * time)

    if released:
        force, tilt = 0.0 * force, 0.0 * tilt

    def rate(t: float, x: np.ndarray, u: float) -> list[float]:
        spring = 10.3**2 * (x[0] + square * x[0] ** 2 + cube * x[0] ** 3)
        return [x[1], 97.0 * u - spring - 2 * 0.11 * 10.3 * x[1]]

    x, shown = np.array([released, 0.0]), []
    for u in force:
        shown.append(x[0])
        done = integrate.solve_ivp(rate, (0.0, PERIOD), x, args=(u,), rtol=1e-8, atol=1e-10)
        x = done.y[:, -1]
    columns = {"force": force, "tilt": tilt, "place": np.array(shown)}
    columns["place"] = columns["place"] + noise * rng.standard_normal(time.size)
    channels = {r: Channel(r, time, v, ROLES.unit(r), "bus", "made") for r, v in columns.items()}
    return Recording(Path(f"spring{seed}"), {}, None, ROLES, channels, {})
