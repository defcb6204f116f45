"""A true motorcycle, and its vehicle file with measured parameters and their uncertainty.

Every parameter has a normal error of its logarithm; its 95 % half width is stated beside it. In a
careless file the errors are uniform up to three of the stated standard deviations. A tyre that is no
magic formula is stated as the magic formula that fits its curve. Filters of sensors are stated.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy import optimize

from slipbench.studies.blind_validation.generator.filters import LAG, Filter
from slipbench.studies.blind_validation.generator.machine import Machine
from slipbench.studies.blind_validation.generator.tyres import MAGIC, force

RPM, DEGREE = math.pi / 30.0, math.pi / 180.0
NORMAL_95 = 1.959964
FURTHEST = 3.0  # standard deviations
GEARS = (11.4, 8.75, 7.25, 6.3, 5.65, 5.2)

Range = tuple[float, float]
# field: (block, parameter, unit, range of true values, 95 % half width of the stated value)
FIELDS: Mapping[str, tuple[str, str, str, Range, float]] = {
    "servo_frequency": ("throttle_servo", "natural_frequency", "rad/s", (69.0, 88.0), 0.05),
    "servo_damping": ("throttle_servo", "damping", "1", (0.35, 0.7), 0.12),
    "servo_delay": ("throttle_servo", "delay", "s", (3e-3, 6e-3), 0.25),
    "air_delay": ("intake", "delay", "s", (7e-3, 12e-3), 0.3),
    "filling_time": ("intake", "filling_time", "s", (4e-3, 10e-3), 0.4),
    "crank_inertia": ("engine", "inertia", "kg*m^2", (0.0155, 0.021), 0.15),
    "peak_torque": ("engine", "peak_torque", "N*m", (104.0, 120.0), 0.05),
    "peak_speed": ("engine", "peak_speed", "rad/s", (11000 * RPM, 12000 * RPM), 0.015),
    "torque_width": ("engine", "torque_width", "rad/s", (7400 * RPM, 8800 * RPM), 0.12),
    "friction": ("engine", "friction", "N*m", (3.0, 5.0), 0.4),
    "friction_rise": ("engine", "friction_rise", "N*m*s/rad", (6e-3, 9e-3), 0.3),
    "opening_scale": ("engine", "opening_scale", "1", (0.19, 0.25), 0.12),
    "torque_scale": ("engine", "torque_scale", "1", (0.97, 1.03), 0.05),
    "spark_gain": ("engine", "spark_gain", "1/rad", (0.010 / DEGREE, 0.014 / DEGREE), 0.15),
    "spark_delay": ("engine", "spark_delay", "s", (3e-3, 6e-3), 0.25),
    "stiffness": ("driveline", "stiffness", "N*m/rad", (3000.0, 4200.0), 0.14),
    "damping": ("driveline", "damping", "N*m*s/rad", (4.0, 15.0), 0.5),
    "clutch": ("driveline", "clutch_capacity", "N*m", (240.0, 300.0), 0.15),
    "wheel_inertia": ("rear_wheel", "inertia", "kg*m^2", (0.6, 0.72), 0.08),
    "radius": ("rear_wheel", "radius", "m", (0.314, 0.326), 0.009),
    "rolling": ("rear_wheel", "rolling_torque", "N*m", (0.6, 1.6), 0.6),
    "slip_stiffness": ("tyre", "slip_stiffness", "N", (28e3, 60e3), 0.35),
    "grip": ("tyre", "friction", "1", (1.15, 1.4), 0.15),
    "load": ("tyre", "load", "N", (1300.0, 1800.0), 0.3),
    "shape": ("tyre", "shape", "1", (1.45, 1.65), 0.06),
    "mass": ("body", "mass", "kg", (230.0, 262.0), 0.02),
    "drag_area": ("body", "drag_area", "m^2", (0.32, 0.44), 0.1),
    "air_density": ("body", "air_density", "kg/m^3", (1.15, 1.25), 0.025),
    "rolling_resistance": ("body", "rolling_resistance", "1", (0.010, 0.016), 0.25),
    "front_radius": ("front_wheel", "radius", "m", (0.294, 0.306), 0.009),
}
OTHER_SHAPE = 0.2  # of a tyre that is no magic formula: the shape is less certain
RATIO = 0.0012


@dataclass(frozen=True)
class Noises:
    """Sensor noise, SI, as the vehicle file states it. jitter: s, of a tooth's time."""

    throttle: float
    throttle_quantum: float
    engine_speed: float
    optical: float
    jitter: float
    latency: float


@dataclass(frozen=True)
class Truth:
    """Ground truth of a motorcycle. gears: true ratios; filters: of its sensors, by channel."""

    machine: Machine
    formula: int
    gears: tuple[float, ...]
    noises: Noises
    filters: Mapping[str, Filter] = field(default_factory=dict)


def draw_truth(rng: np.random.Generator, formula: int) -> Truth:
    """Random motorcycle of the class."""
    values = {name: float(rng.uniform(*entry[3])) for name, entry in FIELDS.items()}
    gears = tuple(float(g * np.exp(0.01 * rng.standard_normal())) for g in GEARS)
    noises = Noises(
        throttle=float(rng.uniform(2e-4, 4e-4)),
        throttle_quantum=float(rng.choice((5e-4, 1e-3))),
        engine_speed=float(rng.uniform(0.2, 0.4)),
        optical=float(rng.uniform(0.01, 0.03)),
        jitter=float(rng.uniform(0.3e-6, 1e-6)),
        latency=2e-3,
    )
    return Truth(Machine(**values), formula, gears, noises)


def vehicle_tree(rng: np.random.Generator, truth: Truth, careless: bool = False) -> dict[str, Any]:
    """Tree of the vehicle file: every parameter with its error and its uncertainty.

    careless: the errors are uniform up to three standard deviations instead of normal.
    """
    draw = _careless if careless else _normal
    tree: dict[str, Any] = {"name": "sealed", "description": "Measured in the workshop"}
    tree["gears"] = {
        str(i): _measured(draw(rng), g, "1", RATIO) for i, g in enumerate(truth.gears, start=1)
    }
    true = as_magic_formula(truth)
    for name, (block, parameter, unit, _, share) in FIELDS.items():
        wide = truth.formula != MAGIC and name == "shape"
        stated = _measured(draw(rng), true[name], unit, OTHER_SHAPE if wide else share)
        tree.setdefault(block, {})[parameter] = stated
    tree["tyre"]["shape"]["value"] = min(max(tree["tyre"]["shape"]["value"], 1.06), 1.94)
    tree["channels"] = channels(truth.noises, truth.filters)
    if lags := [_stated_lag(c, f) for c, f in truth.filters.items() if f.kind == LAG]:
        tree["effects"] = lags
    return tree


def channels(
    noises: Noises, filters: Mapping[str, Filter] = MappingProxyType({})
) -> dict[str, Any]:
    """Data-sheet values of the sensors; the group delay of a moving mean is part of the latency."""
    found: dict[str, Any] = {
        "throttle_position": _channel(noises, noises.throttle, noises.throttle_quantum, "1"),
        "engine_speed": _channel(noises, noises.engine_speed, 0.5 * RPM, "rad/s"),
        "optical_speed": {
            **_channel(noises, noises.optical, 0.005, "m/s"),
            "clock": "optical",
            "period": {"value": 4e-3, "unit": "s"},
        },
    }
    for channel, chosen in filters.items():
        if chosen.kind != LAG:
            found[channel]["latency"]["value"] += chosen.group_delay
    return found


def _stated_lag(channel: str, chosen: Filter) -> dict[str, Any]:
    time = {"value": chosen.time, "unit": "s"}
    return {"name": "channel_lag", "channel": channel, "time_constant": time}


def _channel(noises: Noises, noise: float, quantum: float, unit: str) -> dict[str, Any]:
    return {
        "latency": {"value": noises.latency, "unit": "s"},
        "noise": {"value": noise, "unit": unit},
        "quantum": {"value": quantum, "unit": unit},
    }


def _normal(rng: np.random.Generator) -> float:
    """Error of a measured number, standard deviations."""
    return float(np.clip(rng.standard_normal(), -FURTHEST, FURTHEST))


def _careless(rng: np.random.Generator) -> float:
    """Error of a number that was measured with less care than the file says, standard deviations."""
    return float(rng.uniform(-FURTHEST, FURTHEST))


def _measured(error: float, true: float, unit: str, share: float) -> dict[str, Any]:
    stated = true * math.exp(-error * share / NORMAL_95)
    return {"value": stated, "unit": unit, "plus_minus": share * stated}


def as_magic_formula(truth: Truth) -> dict[str, float]:
    """Parameters of the machine; those of the tyre as the magic formula closest to its curve."""
    true = truth.machine._asdict()
    if truth.formula == MAGIC:
        return true
    C, D = true["slip_stiffness"], true["grip"] * true["load"]
    slip = np.linspace(0.0, 2.0 * D / C, 80)
    curve = np.array([force(truth.formula, s, C, D, 0.0) for s in slip])

    def miss(z: Any) -> Any:
        c, d, shape = C * np.exp(z[0]), D * np.exp(z[1]), 1.5 + 0.44 * np.tanh(z[2])
        return (np.array([force(MAGIC, s, c, d, shape) for s in slip]) - curve) / D

    z = optimize.least_squares(miss, (0.0, 0.0, 0.0)).x
    true["slip_stiffness"], true["shape"] = C * math.exp(z[0]), 1.5 + 0.44 * math.tanh(z[2])
    true["grip"] *= math.exp(z[1])
    return true
