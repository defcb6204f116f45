"""Mounting angle: the speed sensor does not look along the road.

Clamped to the frame a few degrees off, the sensor sees only the part of the speed along its own
axis. The frame pitches as the motorcycle accelerates, and the angle changes with it.

Equation
--------
    s = v cos(beta + p a)

Symbols
-------
    beta   angle   between the sensor's axis and the road      rad         0.03 to 0.15 (absent 0)
    p      pitch   of the frame by acceleration                rad s^2/m   4e-3 (absent 0)
    v, a           true speed, acceleration                    m/s, m/s^2

Trace
-----
The optical speed reads a constant share too low, and a little less or more while accelerating.

Confused with
-------------
Scale of the optical sensor: only hard acceleration separates them.

Reference
---------
Cossalter, "Motorcycle Dynamics", 2nd edition (2006), on pitch in acceleration; data sheets of
correlation sensors (Kistler Correvit) give the cosine as their mounting error.
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def look_aside(optical_speed: float, acceleration: float, angle: float, pitch: float) -> float:
    """The part of the speed along the sensor's axis [m/s]."""
    return optical_speed * math.cos(angle + pitch * acceleration)


@dataclass(frozen=True)
class MountingAngle(Effect):
    """Angle between the optical sensor and the road."""

    name = "mounting_angle"
    block = "optical_sensor"
    shows_in = ("optical_speed",)
    confused_with = ("optical_scale",)
    hooks = (Hook("optical_speed", look_aside),)

    angle: float = parameter(
        0.1, "rad", -0.7, 0.7, "between the sensor's axis and the road", absent=0.0, smallest=0.04
    )
    pitch: float = parameter(
        4e-3, "rad*s^2/m", -0.03, 0.03, "of the frame by acceleration", absent=0.0, smallest=1e-3
    )
