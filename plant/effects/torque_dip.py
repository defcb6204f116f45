"""Torque dip: in one band of engine speed the torque falls short of its smooth curve.

A wave reflected in the exhaust arrives while the valves overlap and spoils the filling, or the map
has a flat spot there. Outside the band nothing is amiss.

Equation
--------
    T -= A exp(-((w_e - w_0) / W)^2 / 2)

Symbols
-------
    A     depth    at the centre                N m     2 to 8 (absent 0)
    w_0   centre   crank speed of the dip       rad/s   1410 (13 500 rpm)
    W     width    of the bell                  rad/s   73 (700 rpm)

Trace
-----
Less acceleration in one band of engine speed, in every gear alike; a slope of torque over speed on
either side, which adds to or takes from the damping.

Confused with
-------------
Load transfer, and slow wind while the speed drifts: another gear puts the band at another road
speed and separates them.

Reference
---------
Blair, "Design and Simulation of Four-Stroke Engines", SAE (1999), on exhaust tuning; Heywood,
"Internal Combustion Engine Fundamentals" (1988), chapter 6.
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import evenly, parameter


def dip(
    engine_torque: float, engine_speed: float, depth: float, centre: float, width: float
) -> float:
    """The torque [N m] less the dip at this speed."""
    x = (engine_speed - centre) / width
    return engine_torque - depth * math.exp(-0.5 * x * x)


@dataclass(frozen=True)
class TorqueDip(Effect):
    """A band of engine speed with less torque."""

    name = "torque_dip"
    block = "engine"
    shows_in = ("engine_speed", "rear_teeth")
    confused_with = ("load_transfer", "closed_throttle_friction", "wind")
    hooks = (Hook("engine_torque", dip),)

    depth: float = parameter(5.0, "N m", -30.0, 30.0, "at the centre", absent=0.0, smallest=1.5)
    centre: float = parameter(
        1410.0, "rad/s", 100.0, 2000.0, "crank speed of the dip", sought=evenly(300.0, 1900.0, 80.0)
    )
    width: float = parameter(73.0, "rad/s", 10.0, 500.0, "of the bell")
