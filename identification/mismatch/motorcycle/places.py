"""Where something may act on a motorcycle, and by which inputs a push there is made."""

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
"""The wheel's torque is pushed through the rear brake, with its sign."""
OVER_RATIO = {"driveline torque": "engine_disturbance"}
"""The crank's part of a torque at the wheel is divided by the gear."""
OVER_RADIUS = {"tyre force": "rear_brake"}
"""The wheel's part of a force on the road is multiplied by the rolling radius."""


def columns(
    place: InjectionPoint, bike: Motorcycle, record: Record, course: Floats
) -> dict[str, Floats]:
    """Columns of the inputs for a course of the injected quantity, row by row.

    What pushes in the servo goes in with the command, as much earlier as the servo delays that.
    """
    found: Mapping[str, float] = place.inputs
    if "throttle_command" in found:
        course = later(course, -bike.throttle_servo.delay / record.grid.step)
    ratio = bike.gears[int(Inputs(record.inputs).gear[0]) - 1]
    radius = bike.rear_wheel.radius
    scaled = {}
    for name, factor in found.items():
        factor /= ratio if OVER_RATIO.get(place.name) == name else 1.0
        factor *= radius if OVER_RADIUS.get(place.name) == name else 1.0
        scaled[name] = factor * course
    assert set(scaled) <= set(Inputs.names)
    return scaled


def later(course: Floats, rows: float) -> Floats:
    """Return a course so many rows later (earlier: negative), its ends continued."""
    row = np.arange(float(course.size))
    return np.interp(row - rows, row, course)


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
"""Last seam of each place, in the order of the equations."""


def acts_at(effect: Effect) -> str:
    """Return the name of the place where an effect acts first."""
    if hasattr(effect, "tooth_offsets"):
        return f"{effect.subject.removesuffix('_encoder')} teeth"
    if hasattr(effect, "measure"):
        return f"sensor of {effect.subject.replace('_', ' ')}"
    if not effect.hooks:
        return ""
    order = [e.__name__ for e in EQUATIONS]
    first = min(order.index(hook.seam) for hook in effect.hooks)
    return next(place for seam, place in UP_TO if first <= order.index(seam))
