"""Injection points of a motorcycle, and the inputs that carry a disturbance there."""

from collections.abc import Mapping

import numpy as np

from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.plant.effects.effect import Effect
from slipbench.plant.equations import EQUATIONS
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Floats, Inputs

PLACES = (
    InjectionPoint("servo force", "throttle_servo", "1", 0.01, "servo", {"throttle_command": 1.0}),
    InjectionPoint("engine torque", "engine", "N m", 5.0, "motion", {"engine_disturbance": 1.0}),
    InjectionPoint(
        "driveline torque",
        "driveline",
        "N m",
        40.0,
        "motion",
        {"engine_disturbance": -1.0, "rear_brake": -1.0},
    ),
    InjectionPoint(
        "tyre force", "tyre", "N", 100.0, "motion", {"rear_brake": 1.0, "road_force": 1.0}
    ),
    InjectionPoint("wheel torque", "rear_wheel", "N m", 20.0, "motion", {"rear_brake": -1.0}),
    InjectionPoint("road force", "body", "N", 60.0, "motion", {"road_force": 1.0}),
)
"""A wheel torque is applied through the rear brake, with the sign of the brake."""
OVER_RATIO = {"driveline torque": "engine_disturbance"}
"""Input whose share of a torque at the wheel is divided by the gear ratio."""
OVER_RADIUS = {"tyre force": "rear_brake"}
"""Input whose share of a force on the road is multiplied by the rolling radius."""


def columns(
    injection: InjectionPoint, bike: Motorcycle, record: Record, waveform: Floats
) -> dict[str, Floats]:
    """Return columns of the inputs by name, SI, shape (rows,), for a waveform of a disturbance.

    waveform: of the injected quantity, SI, shape (rows,). A disturbance of the servo is added to
    the command, earlier by the delay of the servo.
    """
    factors: Mapping[str, float] = injection.inputs
    if "throttle_command" in factors:
        waveform = later(waveform, -bike.throttle_servo.delay / record.grid.step)
    ratio = bike.gears[int(Inputs(record.inputs).gear[0]) - 1]
    radius = bike.rear_wheel.radius
    scaled = {}
    for name, factor in factors.items():
        factor /= ratio if OVER_RATIO.get(injection.name) == name else 1.0
        factor *= radius if OVER_RADIUS.get(injection.name) == name else 1.0
        scaled[name] = factor * waveform
    assert set(scaled) <= set(Inputs.names)
    return scaled


def later(waveform: Floats, rows: float) -> Floats:
    """Return a waveform delayed by so many rows (negative: advanced), its ends continued.

    waveform: shape (rows,), as the result.
    """
    row = np.arange(float(waveform.size))
    return np.interp(row - rows, row, waveform)


UP_TO = (
    ("servo_acceleration", "servo force"),
    ("engine_torque", "engine torque"),
    ("twist_velocity", "driveline torque"),
    ("wheel_torque", "driveline torque"),
    ("engine_acceleration", "engine torque"),
    ("tyre_force", "tyre force"),
    ("rear_acceleration", "wheel torque"),
    ("front_speed", "sensor of front teeth"),
    ("acceleration", "road force"),
    ("optical_speed", "sensor of optical speed"),
)
"""Last seam of each injection point, in the order of the equations."""


def acts_at(effect: Effect) -> str:
    """Return the name of the first injection point or sensor of an effect; empty: none."""
    if hasattr(effect, "tooth_offsets"):
        return f"{effect.subject.removesuffix('_encoder')} teeth"
    if hasattr(effect, "measure"):
        return f"sensor of {effect.subject.replace('_', ' ')}"
    if not effect.hooks:
        return ""
    order = [e.__name__ for e in EQUATIONS]
    first = min(order.index(hook.seam) for hook in effect.hooks)
    return next(injection for seam, injection in UP_TO if first <= order.index(seam))
