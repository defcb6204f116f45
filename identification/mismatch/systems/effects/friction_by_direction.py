"""Friction by direction: friction differs between the two directions of motion.

A lip seal, a brush at an angle, a preloaded guide. It acts only in motion: at rest it is zero.

Equation
--------
    f -= D |tanh(v / v_r)|

Symbols
-------
    D     difference   half of the force up less that down   of the seam    0.02 to 0.5 of it (absent 0)
    v_r   creep        speed within which it is reached      of the speed   0.01 of the usual one
    v                  speed of the seam (`along`)

Trace
-----
What is left over has the same sign in both directions of motion and is gone at rest.

Confused with
-------------
Offset (stays at rest): a pause within the run. Asymmetry (goes with the force), back-drive loss
(goes with the load).

Reference
---------
Armstrong-Helouvry, Dupont and Canudas de Wit, "A survey of models, analysis tools and compensation
methods for the control of machines with friction", Automatica 30 (1994).
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def rub(value: float, other: float, difference: float, creep: float) -> float:
    """Return the remaining force."""
    return value - difference * abs(math.tanh(other / creep))


@dataclass(frozen=True)
class FrictionByDirection(SeamEffect):
    """A difference of friction between the two directions."""

    name = "friction_by_direction"
    block = "seam"
    confused_with = ("offset", "asymmetry", "back_drive_loss")
    acts_on = (SEAM,)
    uses = "along"
    act = rub

    difference: float = parameter(
        0.1, "[seam]", -3.0, 3.0, "half of the force up less that down", absent=0.0, smallest=0.03
    )
    creep: float = parameter(0.01, "[other]", 1e-4, 1.0, "speed within which it is reached")
