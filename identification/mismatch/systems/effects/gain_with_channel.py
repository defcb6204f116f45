"""Gain with a channel: the gain depends on another recorded quantity.

A supply voltage sags, a fluid warms, a lever turns: the gain varies with another quantity.

Equation
--------
    f *= 1 + g z

Symbols
-------
    g   slope   of the gain   over the other quantity   0.02 to 0.5 over its magnitude (absent 0)
    z           the other quantity

Trace
-----
What is left over, divided by the quantity, follows the other one along a line.

Confused with
-------------
A gain with the size of the other quantity (the same for both signs of it).

Reference
---------
Rugh and Shamma, "Research on gain scheduling", Automatica 36 (2000).
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def follow(value: float, other: float, slope: float) -> float:
    """Return the value times the present gain."""
    return value * (1.0 + slope * other)


@dataclass(frozen=True)
class GainWithChannel(SeamEffect):
    """A gain that goes with another quantity."""

    name = "gain_with_channel"
    block = "seam"
    confused_with = ("gain_with_size", "gain_with_tilt", "scale")
    uses = "channel"
    act = follow

    slope: float = parameter(0.1, "[1/other]", -5.0, 5.0, "of the gain", absent=0.0, smallest=0.02)
