"""Rate limit: a quantity cannot change faster than so.

A motor turns no faster, an amplifier slews, a controller ramps.

Equation
--------
    |f'| <= R

Symbols
-------
    R   limit   of the rate   of the quantity over time   (absent infinite)

Trace
-----
Steps become ramps, large sines become triangles; small motion is as it was.

Confused with
-------------
Lag (small motion too): two amplitudes at one frequency.

Reference
---------
Gelb and Vander Velde, "Multiple-input describing functions" (1968), chapter 2.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def ramp(
    value: float, memory: float, step: float, limit: float, period: float
) -> tuple[float, float]:
    """Return what it has become, twice: it is what is remembered."""
    most = limit / period * step
    new = min(max(value, memory - most), memory + most)
    return new, new


@dataclass(frozen=True)
class RateLimit(SeamEffect):
    """A largest rate."""

    name = "rate_limit"
    block = "seam"
    confused_with = ("lag", "saturation")
    acts_on = (INPUT, SEAM)
    remembers = 1
    act = ramp

    limit: float = parameter(
        0.15, "[seam]", 1e-5, 1e9, "largest change within a period", absent=math.inf, smallest=0.5
    )
    period: float = parameter(1.0, "[time]", 1e-9, 1e9, "time in which that change is allowed")
