"""Hardening: stiffness grows with the deflection, equally in both directions.

A spring at large deflection stretches as well as it bends; rubber hardens; a pendulum softens.

Equation
--------
    f += c f^3

Symbols
-------
    c   cube   per square of magnitude   0.03 to 1 over the usual one squared (absent 0)
    f          the quantity at the seam; softening where c is negative

Trace
-----
The resonance moves up with the amplitude; a third harmonic.

Confused with
-------------
Saturation (a corner), a dead zone (about zero alone), a square (even harmonics).

Reference
---------
Kovacic and Brennan, "The Duffing equation" (2011), chapter 1.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def harden(value: float, cube: float) -> float:
    """Return the value plus its cubic term."""
    return value + cube * value * value * value


@dataclass(frozen=True)
class Cubic(SeamEffect):
    """A cube beside the straight line."""

    name = "cubic"
    block = "seam"
    confused_with = ("saturation", "dead_zone", "quadratic")
    act = harden

    cube: float = parameter(
        0.2, "[1/seam^2]", -100.0, 1000.0, "of the cube", absent=0.0, smallest=0.04
    )
