"""The exported motorcycle, and recordings of a motorcycle with effects that the FMU lacks."""

from pathlib import Path

import numpy as np
from scipy.signal import lfilter

from slipbench.plant.fmu.export import write_fmu
from slipbench.plant.fmu.model import FmuModel, model_at
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Inputs
from slipbench.plant.simulation import Simulation
from slipbench.protocol.extras import optional_library
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap, Source

PERIOD, STEP, SECONDS = 10e-3, 0.5e-3, 12.0  # s
CRANK_SPEED, GEAR = 1466.0, 2  # rad/s
SIZES = {"throttle_position": 5e-4, "engine_speed": 0.3}
UNITS = {"throttle_command": "1", "throttle_position": "1", "engine_speed": "rad/s"}
BESIDE = """
step = "10 ms"
period = "10 ms"
stretch = "1 s"

[parameters.mass]
variable = "body.mass"
value = 245
unit = "kg"
plus_minus = 12

[parameters.damping]
variable = "throttle_servo.damping"
value = 0.4
unit = "1"
plus_minus = 0.05

[inputs.throttle_command]
role = "throttle_command"
size = { value = 0.1, unit = "1" }

[outputs.throttle]
role = "throttle_position"
size = { value = 0.1, unit = "1" }

[outputs.engine_speed]
role = "engine_speed"
size = { value = 1000, unit = "rad/s" }
"""
ROLES = RoleMap(title="motorcycle", roles={role: Source(column=role) for role in UNITS})


def nominal_model() -> FmuModel:
    """The motorcycle of the plant's defaults in a steady state."""
    return model_at("motorcycle", Simulation(Motorcycle(), STEP), GEAR, CRANK_SPEED)


def exported(folder: Path, version: int, text: str = BESIDE) -> Path:
    """Write the FMU of the nominal motorcycle and its model file."""
    path = folder / f"motorcycle{version}.fmu"
    headers = Path(str(optional_library("fmpy").__file__)).parent / "c-code"
    write_fmu(path, nominal_model(), version, headers)
    path.with_suffix(".toml").write_text(text, encoding="utf-8")
    return path


def recorded_ride(seed: int, ceiling: float = 1.0, lag: float = 0.0) -> Recording:
    """A ride about the steady state, with noise.

    ceiling: opening above which the command has no further effect; lag: time constant of the
    sensor of the engine speed, s.
    """
    print(f"seed {seed}")
    model = nominal_model()
    random = np.random.default_rng(seed)
    rows = round(SECONDS / PERIOD)
    steps = np.repeat(random.normal(size=rows // 20), 20)
    command = np.clip(model.command + 0.03 * lfilter([0.2], [1.0, -0.8], steps), 0.005, 0.9)
    per_row = round(PERIOD / STEP)
    simulation = Simulation(model.motorcycle, STEP, per_row, 2)
    state = simulation.state(throttle_command=model.command, **model.initial)
    inputs = Inputs.held(rows, gear=float(GEAR), throttle_command=np.minimum(command, ceiling))
    out = simulation.trajectories(state, inputs, ("throttle", "engine_speed"))
    fine = 2 * STEP
    share = 1.0 - np.exp(-fine / lag) if lag else 1.0
    slow, _ = lfilter(
        [share], [1.0, share - 1.0], out["engine_speed"], zi=[(1.0 - share) * CRANK_SPEED]
    )
    every = round(PERIOD / fine)
    shown = {
        "throttle_position": out["throttle"][every - 1 :: every],
        "engine_speed": np.asarray(slow)[every - 1 :: every],
    }
    time = PERIOD * np.arange(rows)
    channels = {"throttle_command": channel("throttle_command", time, command)}
    for name, values in shown.items():
        noisy = values + SIZES[name] * random.normal(size=rows)
        channels[name] = channel(name, time + PERIOD, noisy)
    return Recording(Path(f"ride{seed}"), {}, None, ROLES, channels, {})


def channel(role: str, time: np.ndarray, values: np.ndarray) -> Channel:
    return Channel(role, time, values, UNITS[role], "bus", "made")
