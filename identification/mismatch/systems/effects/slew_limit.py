"""Slew limit: a state that follows a command has a largest rate.

A valve spool, a hydraulic cylinder or a servo with a position command has a top speed,
whatever the distance. It acts at the rate of a state that is not a speed itself.

Equation
--------
    |x'| <= R

Symbols
-------
    R   limit   greatest rate   of the state over time   (absent infinite)

Trace
-----
Large steps are ramps, the same slope for all; small motion is as it was.

Confused with
-------------
Rate limit of the command (before the loop, not within); saturation of what drives the state; lag
(small motion too): two amplitudes at one frequency.

Reference
---------
Gelb and Vander Velde, "Multiple-input describing functions" (1968), chapter 2.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import RATE, SeamEffect
from slipbench.plant.parameters import parameter


def hold(value: float, limit: float) -> float:
    """Return the limited rate."""
    return min(max(value, -limit), limit)


@dataclass(frozen=True)
class SlewLimit(SeamEffect):
    """A largest rate of a state."""

    name = "slew_limit"
    block = "seam"
    confused_with = ("rate_limit", "saturation", "lag")
    acts_on = (RATE,)
    uses = "of_store"
    variants = (1.0, 0.3, 0.1, 0.03)
    varies = "limit"
    act = hold

    limit: float = parameter(
        0.3, "[seam]", 1e-9, 1e9, "greatest rate", absent=math.inf, smallest=0.6
    )
