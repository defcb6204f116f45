"""Supply limit: the faster a motor turns, the less torque its supply can give it.

At rest the whole voltage drives current through the winding. In motion the back EMF opposes it,
and at the no-load speed the torque is zero. In braking both voltages add up.

Equation
--------
    -L (1 + v / V) <= f <= L (1 - v / V),   each share not below 2 %

Symbols
-------
    L   limit      of the force at rest          of the seam    0.3 to 1.5 of it (absent infinite)
    V   no_load    speed of zero force           of the speed   0.8 to 5 usual ones
    v              speed of the seam (`along`)

Trace
-----
Large steps begin with a constant acceleration that fades with speed; braking is stronger than
accelerating; small motion is as it was.

Confused with
-------------
Saturation (does not fade with speed), viscous friction (acts on small motion too), back EMF (without
a limit).

Reference
---------
Scattolini et al., "Modeling and control of an electronic throttle body", Control Engineering
Practice 5 (1997).
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def limit_force(value: float, other: float, limit: float, no_load: float) -> float:
    """Return the force that the supply allows."""
    x = other / no_load
    up, down = limit * max(1.0 - x, 0.02), limit * max(1.0 + x, 0.02)
    return min(max(value, -down), up)


@dataclass(frozen=True)
class SupplyLimit(SeamEffect):
    """A largest force that fades with speed."""

    name = "supply_limit"
    block = "seam"
    confused_with = ("saturation", "viscous_friction", "back_emf")
    acts_on = (SEAM,)
    uses = "along"
    act = limit_force

    limit: float = parameter(
        1.0, "[seam]", 1e-3, 1e6, "largest force at rest", absent=math.inf, smallest=2.0
    )
    no_load: float = parameter(2.0, "[other]", 0.05, 1e3, "speed at which none is left")
