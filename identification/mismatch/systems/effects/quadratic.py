"""Square: the gain changes in proportion to the quantity itself.

Drag, valves, off-centre springs: the quadratic term is the first one that a linear model lacks.

Equation
--------
    f += q f^2

Symbols
-------
    q   square   per magnitude   0.05 to 0.5 over the usual magnitude (absent 0)
    f            the quantity at the seam

Trace
-----
A second harmonic that grows with the square of the amplitude, and a mean with it.

Confused with
-------------
Asymmetry (grows with the amplitude, not its square), a cubic (odd harmonics).

Reference
---------
Schetzen, "The Volterra and Wiener theories of nonlinear systems" (1980), chapter 2.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def square(value: float, square: float) -> float:
    """Return the value plus its quadratic term."""
    return value + square * value * value


@dataclass(frozen=True)
class Quadratic(SeamEffect):
    """A square beside the straight line."""

    name = "quadratic"
    block = "seam"
    confused_with = ("asymmetry", "cubic")
    act = square

    square: float = parameter(
        0.2, "[1/seam]", -10.0, 10.0, "share of the square", absent=0.0, smallest=0.04
    )
