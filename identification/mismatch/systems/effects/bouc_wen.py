"""Bouc-Wen hysteresis: a share of a quantity yields along a hysteresis loop.

Rubber, friction dampers and joints with many small contacts are stiff after each reversal and yield
gradually towards a level.

Equation
--------
    z' = f' (1 - |z| / Y) while z f' > 0, else z' = f',   f = (1 - c) f + c z

Symbols
-------
    c   share    of the quantity that yields   1                 0.1 to 1 (absent 0)
    Y   yield    level that it tends to        of the quantity   0.1 to 2 of the usual one
    z            the part that yields

Trace
-----
Loops whose width grows with amplitude up to a level; corners after reversals are sharp, the way into
yield is round. Speed does not matter.

Confused with
-------------
Hysteresis (a pause of one width), saturation (no loop), presliding (a force beside, along a speed).

Reference
---------
Ismail, Ikhouane and Rodellar, "The hysteresis Bouc-Wen model, a survey", Archives of Computational
Methods in Engineering 16 (2009) 161 to 188: with n = 1 and beta = gamma.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def loop(
    value: float, memory: float, second: float, share: float, level: float
) -> tuple[float, float, float]:
    """Return the new quantity, and the memory: the old quantity and the part that yields."""
    change, z = value - memory, second
    if z * change < 0.0:
        elastic = math.copysign(min(abs(change), abs(z)), change)
        z, change = z + elastic, change - elastic
    if change != 0.0:
        end = math.copysign(level, change)
        z = end + (z - end) * math.exp(-abs(change) / level)
    return value + share * (z - value), value, z


@dataclass(frozen=True)
class BoucWen(SeamEffect):
    """A part that yields with memory."""

    name = "bouc_wen"
    block = "seam"
    confused_with = ("hysteresis", "saturation", "presliding")
    acts_on = (SEAM,)
    remembers = 2
    starts = ("value", 0.0)
    act = loop

    share: float = parameter(0.3, "1", 0.0, 1.0, "that yields", absent=0.0, smallest=0.06)
    level: float = parameter(0.7, "[seam]", 1e-3, 1e3, "that it tends to")
