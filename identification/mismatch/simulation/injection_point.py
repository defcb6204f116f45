"""Injection points of a system, and the inputs that carry a disturbance there."""

from collections.abc import Mapping
from dataclasses import dataclass, field

SENSOR = "sensor of "


def at_sensor(output: str) -> str:
    """Return the name of the injection point at the sensor of an output."""
    return SENSOR + output.replace("_", " ")


@dataclass(frozen=True)
class InjectionPoint:
    """subsystem: where it acts; size: typical magnitude of a disturbance, in its unit, SI.

    inputs: inputs of the simulation and their values per unit of the disturbance; the system makes
    columns of them. Empty: a sensor, which responds without a simulation and without delay.
    negligible: share of the size below which a disturbance is of no interest. recorded: whether the
    signal there is recorded, so that a disturbance may be an error of its sensor.
    """

    name: str
    block: str
    unit: str
    size: float
    subsystem: str
    inputs: Mapping[str, float] = field(default_factory=dict)
    negligible: float = 0.02
    recorded: bool = False
