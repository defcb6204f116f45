"""Gain with the size of a channel: it depends on the square of another quantity.

A dependence on a deflection without its direction is quadratic to lowest order.

Equation
--------
    f *= 1 + g z^2

Symbols
-------
    g   square   of the gain   over the other quantity squared   (absent 0)
    z            the other quantity

Trace
-----
What is left over, divided by the quantity, follows the square of the other one.

Confused with
-------------
A linear gain (the signs differ), a gain with a tilt (less curvature).

Reference
---------
Rugh and Shamma, "Research on gain scheduling", Automatica 36 (2000).
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def follow(value: float, other: float, square: float) -> float:
    """Return the value times the present gain."""
    return value * (1.0 + square * other * other)


@dataclass(frozen=True)
class GainWithSize(SeamEffect):
    """A gain that goes with the square of another quantity."""

    name = "gain_with_size"
    block = "seam"
    confused_with = ("gain_with_channel", "gain_with_tilt", "scale")
    uses = "channel"
    act = follow

    square: float = parameter(
        0.1, "[1/other^2]", -5.0, 5.0, "of the gain", absent=0.0, smallest=0.02
    )
