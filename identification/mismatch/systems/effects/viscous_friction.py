"""Viscous friction: a force that opposes the motion in proportion to its speed.

Grease, oil films and eddy currents shear. It is missing in a model file
without damping, or with damping elsewhere, at a seam of a force with a speed.

Equation
--------
    f -= c v

Symbols
-------
    c   coefficient   of the force over the speed   0.02 to 1 of the usual ones (absent 0)
    v                 speed of the seam (`along`)

Trace
-----
What is left over follows the speed along a line through zero; free motion decays by a constant
share in each swing.

Confused with
-------------
Friction (does not grow with speed) and quadratic drag (grows with its square): small and large
speeds. Back EMF: vanishes when the drive is open.

Reference
---------
Olsson, Astrom, Canudas de Wit, Gafvert and Lischinsky, "Friction models and friction compensation"
(1997), classical models; model M1 of Duclusaud, Passault, Padois and Ly, "Extended friction models
for the physics simulation of servo actuators", arXiv 2410.08650 (2024).
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def shear(value: float, other: float, coefficient: float) -> float:
    """Return the remaining force."""
    return value - coefficient * other


@dataclass(frozen=True)
class ViscousFriction(SeamEffect):
    """Friction in proportion to speed."""

    name = "viscous_friction"
    block = "seam"
    confused_with = ("friction", "quadratic_drag", "linear_loss", "back_emf")
    acts_on = (SEAM,)
    uses = "along"
    act = shear

    coefficient: float = parameter(
        0.1, "[seam/other]", -3.0, 3.0, "force over speed", absent=0.0, smallest=0.02
    )
