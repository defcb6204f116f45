"""Saturation: the magnitude of a quantity is limited.

An amplifier runs out of voltage, a valve is fully open, a sensor is at the end of its range.

Equation
--------
    f = min(max(f, -L), L)

Symbols
-------
    L   limit   of the quantity   0.3 to 1.5 of its usual magnitude (absent infinite)
    f           the quantity at the seam

Trace
-----
Tops are cut off; the gain falls with the amplitude.

Confused with
-------------
A softening cubic (no corner), overflow (the loss is a flow): amplitudes about the limit.

Reference
---------
Gelb and Vander Velde, "Multiple-input describing functions" (1968), chapter 2.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def limited(value: float, limit: float) -> float:
    """Return the limited value."""
    return min(max(value, -limit), limit)


@dataclass(frozen=True)
class Saturation(SeamEffect):
    """A limit to both sides."""

    name = "saturation"
    block = "seam"
    confused_with = ("cubic", "overflow")
    act = limited

    limit: float = parameter(
        1.0, "[seam]", 1e-3, 1e9, "largest value", absent=math.inf, smallest=2.0
    )
