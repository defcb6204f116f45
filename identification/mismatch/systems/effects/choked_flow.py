"""Choked flow: positive values of a quantity have a limit, negative values have none.

Gas that leaves a restriction at the speed of sound flows no faster, however low the pressure
downstream; a one-sided valve or a pump at its limit saturates.

Equation
--------
    f = min(f, L)

Symbols
-------
    L   limit   of the quantity   0.3 to 1.5 of its usual magnitude (absent infinite)
    f           the quantity

Trace
-----
Tops are cut off at one level; negative values are as they were.

Confused with
-------------
Saturation (cuts both sides), asymmetry (a slope, not a ceiling). Where no value is negative,
saturation and choked flow are the same.

Reference
---------
Applied Flow Technology, "Modeling choked flow through an orifice".
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def choke(value: float, limit: float) -> float:
    """Return the value, limited from above."""
    return min(value, limit)


@dataclass(frozen=True)
class ChokedFlow(SeamEffect):
    """A ceiling of positive values."""

    name = "choked_flow"
    block = "seam"
    confused_with = ("saturation", "asymmetry", "cavitation")
    acts_on = (INPUT, SEAM)
    act = choke

    limit: float = parameter(
        1.0, "[seam]", 1e-3, 1e9, "largest value", absent=math.inf, smallest=2.0
    )
