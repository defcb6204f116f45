"""Quadratic drag: a force that opposes the motion and grows with the square of its speed.

Air, water and churned oil are displaced: at twice the speed twice the mass per second is
accelerated to twice the speed.

Equation
--------
    f -= c v |v|

Symbols
-------
    c   coefficient   force over speed squared   0.02 to 1 of the usual ones (absent 0)
    v                 speed of the seam (`along`)

Trace
-----
Coasting from high speed slows down fast at first and slowly later; small motion is as it was.

Confused with
-------------
Viscous friction (a line over speed) and friction (a step): a wide range of speeds. Square of the
quantity itself: that goes with the force, not with the speed.

Reference
---------
White, "Fluid mechanics", 8th edition (2016), chapter 7: drag of bodies at high Reynolds number.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def drag(value: float, other: float, coefficient: float) -> float:
    """Return the remaining force."""
    return value - coefficient * other * abs(other)


@dataclass(frozen=True)
class QuadraticDrag(SeamEffect):
    """Drag with the square of speed."""

    name = "quadratic_drag"
    block = "seam"
    confused_with = ("viscous_friction", "friction", "quadratic")
    acts_on = (SEAM,)
    uses = "along"
    act = drag

    coefficient: float = parameter(
        0.1, "[seam/other^2]", -3.0, 3.0, "force over speed squared", absent=0.0, smallest=0.02
    )
