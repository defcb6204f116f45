"""Cavitation: negative values of a quantity have a limit.

Below its vapour pressure a liquid cavitates: suction is limited. A rope, a tyre on the road and a
one-way clutch transmit force in one direction only.

Equation
--------
    f = max(f, -L)

Symbols
-------
    L   limit   of the quantity backwards   0.1 to 1.5 of its usual magnitude (absent infinite)
    f           the quantity

Trace
-----
Bottoms are cut off at one level; positive values are as they were.

Confused with
-------------
Saturation (cuts both sides), asymmetry (a slope, not a floor), choked flow (the other side): values of
both signs.

Reference
---------
White, "Fluid mechanics", 8th edition (2016), chapter 1: vapour pressure and cavitation.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def tear(value: float, limit: float) -> float:
    """Return the value, limited from below."""
    return max(value, -limit)


@dataclass(frozen=True)
class Cavitation(SeamEffect):
    """A floor of negative values."""

    name = "cavitation"
    block = "seam"
    confused_with = ("saturation", "asymmetry", "choked_flow")
    acts_on = (INPUT, SEAM)
    act = tear

    limit: float = parameter(
        1.0, "[seam]", 1e-3, 1e9, "largest negative value", absent=math.inf, smallest=2.0
    )
