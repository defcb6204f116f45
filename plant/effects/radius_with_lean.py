"""Rolling radius with lean: a leaning tyre rolls on its shoulder, nearer to the axle.

A motorcycle tyre is round across. Upright it stands on its crown; leaning it rolls on a smaller
circle, and the wheel turns faster at the same speed.

Equation
--------
    r = r_0 - r_c (1 - cos phi),   not below half of r_0

Symbols
-------
    r_c   crown         radius of the rear tyre's section    m     0.08 to 0.12 (absent 0)
          front_crown   radius of the front tyre's section   m     0.05 to 0.1 (absent 0)
    phi   lean, an input                                     rad

Trace
-----
Wheel speed over true speed grows in every bend, to either side alike, with one minus the cosine of
the lean.

Confused with
-------------
Radius growth (straight ahead as well) and slip (only the driven wheel): the lean angle separates
them.

Reference
---------
Cossalter, "Motorcycle Dynamics", 2nd edition (2006), on the toroidal tyre; Lot, "A motorcycle tire
model for dynamic simulations: theoretical and experimental aspects", Meccanica 39 (2004).
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def lean_over(rear_radius: float, lean: float, crown: float) -> float:
    """The rear rolling radius [m]."""
    return max(rear_radius - crown * (1.0 - math.cos(lean)), 0.5 * rear_radius)


def lean_over_in_front(front_radius: float, lean: float, front_crown: float) -> float:
    """The front rolling radius [m]."""
    return max(front_radius - front_crown * (1.0 - math.cos(lean)), 0.5 * front_radius)


@dataclass(frozen=True)
class RadiusWithLean(Effect):
    """Rolling radii that shrink in a bend."""

    name = "radius_with_lean"
    block = "tyre"
    shows_in = ("rear_teeth", "front_teeth")
    confused_with = ("radius_growth", "optical_scale")
    hooks = (Hook("rear_radius", lean_over), Hook("front_radius", lean_over_in_front))

    crown: float = parameter(
        0.1, "m", 0.0, 0.4, "radius of the rear tyre's section", absent=0.0, smallest=0.02
    )
    front_crown: float = parameter(
        0.07, "m", 0.0, 0.4, "radius of the front tyre's section", absent=0.0, smallest=0.014
    )
