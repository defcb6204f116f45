"""Gain with a tilt: the effective rolling radius shrinks with the tilt angle.

Of a tyre with a round section, a cam or a swash plate the effective radius varies with the cosine
of an angle.

Equation
--------
    f *= 1 - c (1 - cos phi)

Symbols
-------
    c     crown   radius of the section over the rolling radius   1     0.05 to 0.5 (absent 0)
    phi           the angle                                       rad

Trace
-----
What is left over, divided by the quantity, follows one minus the cosine of the angle, to either
side alike.

Confused with
-------------
A gain with the square (more curvature at large angles), slip (depends on force).

Reference
---------
Cossalter, "Motorcycle dynamics", 2nd edition (2006), on the toroidal tyre.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def roll(value: float, other: float, crown: float) -> float:
    """Return the value for the present radius."""
    return value * (1.0 - crown * (1.0 - math.cos(other)))


@dataclass(frozen=True)
class GainWithTilt(SeamEffect):
    """A radius that shrinks with an angle."""

    name = "gain_with_tilt"
    block = "seam"
    confused_with = ("gain_with_size", "gain_with_channel", "scale")
    uses = "angle"
    act = roll

    crown: float = parameter(
        0.25, "1", -2.0, 2.0, "section over rolling radius", absent=0.0, smallest=0.05
    )
