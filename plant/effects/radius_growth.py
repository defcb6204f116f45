"""Radius growth: the tyre grows with speed.

Centrifugal force stretches the belt, on cross-ply racing tyres by centimetres. A faster wheel rolls
further in a turn than the radius measured in the pits would say.

Equation
--------
    r = r_0 (1 + g v^2)   for the rear, with g_f for the front

Symbols
-------
    g     growth         of the rear radius                  s^2/m^2   0.5e-5 to 1.5e-5 (absent 0)
    g_f   front_growth   of the front radius                 s^2/m^2   0.2e-5 to 1e-5 (absent 0)
    v                    speed                               m/s

Trace
-----
Wheel speed against true speed departs with the square of the speed, driven or coasting.

Confused with
-------------
A scale of the optical sensor (the same at all speeds): a coast-down separates them. Load transfer:
wide excitation at high speed.

Reference
---------
Pacejka, "Tire and Vehicle Dynamics", 3rd edition (2012), chapter 1; Genta, "Motor Vehicle Dynamics"
(1997), on the rolling radius.
"""

from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def grow(rear_radius: float, speed: float, growth: float) -> float:
    """The rear rolling radius [m]."""
    return rear_radius * (1.0 + growth * speed * speed)


def grow_in_front(front_radius: float, speed: float, front_growth: float) -> float:
    """The front rolling radius [m]."""
    return front_radius * (1.0 + front_growth * speed * speed)


@dataclass(frozen=True)
class RadiusGrowth(Effect):
    """Rolling radii that grow with speed."""

    name = "radius_growth"
    block = "tyre"
    shows_in = ("rear_teeth", "front_teeth")
    confused_with = ("optical_scale", "load_transfer", "radius_with_lean")
    hooks = (Hook("rear_radius", grow), Hook("front_radius", grow_in_front))

    growth: float = parameter(
        1e-5, "s^2/m^2", 0.0, 5e-5, "of the rear radius", absent=0.0, smallest=2e-6
    )
    front_growth: float = parameter(
        5e-6, "s^2/m^2", 0.0, 5e-5, "of the front radius", absent=0.0, smallest=1e-6
    )
