"""Where something may act on a motorcycle, and by which inputs a push there is made."""

from collections.abc import Mapping

from identification.mismatch.place import Injection
from identification.mismatch.record import Record
from plant.motorcycle import Motorcycle
from plant.signals import Floats, Inputs

PLACES = (
    Injection("servo force", "throttle_servo", "1", 0.01, "servo", {"throttle_command": 1.0}),
    Injection("engine torque", "engine", "N m", 5.0, "motion", {"engine_disturbance": 1.0}),
    Injection("driveline torque", "driveline", "N m", 40.0, "motion",
              {"engine_disturbance": -1.0, "rear_brake": -1.0}),
    Injection("tyre force", "tyre", "N", 100.0, "motion", {"rear_brake": 1.0, "road_force": 1.0}),
    Injection("wheel torque", "rear_wheel", "N m", 20.0, "motion", {"rear_brake": -1.0}),
    Injection("road force", "body", "N", 60.0, "motion", {"road_force": 1.0}),
)  # fmt: skip
"""The wheel's torque is pushed through the rear brake, with its sign."""
OVER_RATIO = {"driveline torque": "engine_disturbance"}
"""The crank's part of a torque at the wheel is divided by the gear."""
OVER_RADIUS = {"tyre force": "rear_brake"}
"""The wheel's part of a force on the road is multiplied by the rolling radius."""


def columns(
    place: Injection, bike: Motorcycle, record: Record, course: Floats
) -> dict[str, Floats]:
    """Columns of the inputs for a course of the injected quantity, row by row."""
    found: Mapping[str, float] = place.push
    ratio = bike.gears[int(Inputs(record.inputs).gear[0]) - 1]
    radius = bike.rear_wheel.radius
    scaled = {}
    for name, factor in found.items():
        factor /= ratio if OVER_RATIO.get(place.name) == name else 1.0
        factor *= radius if OVER_RADIUS.get(place.name) == name else 1.0
        scaled[name] = factor * course
    assert set(scaled) <= set(Inputs.names)
    return scaled
