"""Overflow: a store loses its inflow above a level.

A tank is full, a store is limited. Inflow beyond that leaves over the edge; some of it may enter
another store below.

Equation
--------
    x' = f - w,   w = max(x - L, 0) / T,   T = 4 steps;   the other state gains s w

Symbols
-------
    L   level   at which it is full   of the state   0.7 to 1.2 of its magnitude (absent infinite)
    s   share   of the overflow that the other state gains     1   0 to 1
    x           the state

Trace
-----
The state stays at its level while it is filled; what stands below fills at once.

Confused with
-------------
Saturation of the sensor (the state rises further): the time that it takes to fall.

Reference
---------
Schoukens, Mattsson, Wigren and Noel, "Cascaded tanks benchmark combining soft and hard
nonlinearities", Workshop on nonlinear system identification benchmarks (2016).
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import RATE, SeamEffect
from slipbench.plant.parameters import parameter


def spill(
    value: float, rate_of: float, level: float, share: float, step: float
) -> tuple[float, float]:
    """Return the remaining rate, and the rate that the other state gains."""
    over = max(rate_of - level, 0.0) / (4.0 * step)
    return value - over, share * over


@dataclass(frozen=True)
class Overflow(SeamEffect):
    """A state with an edge."""

    name = "overflow"
    block = "seam"
    confused_with = ("saturation", "quadratic")
    acts_on = (RATE,)
    uses = "into"
    gives = True
    act = spill

    level: float = parameter(
        1.0, "[other]", 1e-3, 1e9, "at which it is full", absent=math.inf, smallest=2.0
    )
    share: float = parameter(0.5, "1", 0.0, 2.0, "of what runs over that the other state gains")
