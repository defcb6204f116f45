"""Reversed sign: a channel has the opposite sign.

A sensor was mounted backwards, or its description has the wrong sign.

Equation
--------
    f -= 2 c f

Symbols
-------
    c   share   1 where it is reversed   1   (absent 0)

Trace
-----
The channel correlates with what it should show, and with the wrong sign.

Confused with
-------------
A wrong scale (keeps the sign), direction blind (one sign alone).

Reference
---------
ISO 8855:2011, on the directions of vehicle axes.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, OUTPUT, SeamEffect
from slipbench.plant.parameters import parameter


def reverse(value: float, share: float) -> float:
    """Return the value with the sign reversed."""
    return value * (1.0 - 2.0 * share)


@dataclass(frozen=True)
class ReversedSign(SeamEffect):
    """A sign the wrong way round."""

    name = "reversed_sign"
    block = "seam"
    confused_with = ("scale", "direction_blind")
    acts_on = (INPUT, OUTPUT)
    act = reverse

    share: float = parameter(1.0, "1", 0.0, 1.0, "1 where it is reversed", absent=0.0, smallest=0.9)
