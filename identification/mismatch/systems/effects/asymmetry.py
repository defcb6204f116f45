"""Asymmetry: positive and negative values have different gains.

Causes are a return spring, a leaking rectifier or gravity.

Equation
--------
    f *= 1 + a sign f / 2

Symbols
-------
    a   share   by which the gain of positive values is larger   1   0.05 to 0.5 (absent 0)
    f           the quantity at the seam

Trace
-----
Even harmonics and a mean that grows with the amplitude.

Confused with
-------------
An offset (does not grow with the amplitude), a square (no corner at zero): two amplitudes.

Reference
---------
Gelb and Vander Velde, "Multiple-input describing functions" (1968), chapter 6.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def prefer(value: float, share: float) -> float:
    """Return the value times the gain of its sign."""
    return value * (1.0 + 0.5 * share) if value > 0.0 else value * (1.0 - 0.5 * share)


@dataclass(frozen=True)
class Asymmetry(SeamEffect):
    """Different gains for the two signs."""

    name = "asymmetry"
    block = "seam"
    confused_with = ("quadratic", "direction_blind", "offset")
    act = prefer

    share: float = parameter(
        0.3, "1", -1.9, 1.9, "excess of positive over negative", absent=0.0, smallest=0.06
    )
