"""Offset: a channel does not read zero at zero.

A bridge is out of balance, a level has another reference, a constant force acts.

Equation
--------
    f += o

Symbols
-------
    o   amount   of the quantity   0.02 to 0.5 of it (absent 0)

Trace
-----
A constant, whatever happens.

Confused with
-------------
Asymmetry (grows with the amplitude), a slow unknown disturbance.

Reference
---------
JCGM 200:2012, "International vocabulary of metrology", 4.20 on datum error.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def shift(value: float, amount: float) -> float:
    """Return the value plus the constant."""
    return value + amount


@dataclass(frozen=True)
class Offset(SeamEffect):
    """A constant too much."""

    name = "offset"
    block = "seam"
    confused_with = ("asymmetry", "scale")
    act = shift

    amount: float = parameter(0.15, "[seam]", -5.0, 5.0, "too much", absent=0.0, smallest=0.03)
