"""Thermal gain: the gain of a drive falls with its temperature.

Losses grow with the square of the demand. Magnets lose about 1 % for each 10 K, copper gains
resistance, oil thins. It takes seconds to minutes and outlasts short pauses.

Equation
--------
    T' = (f^2 - T) / tau,   f *= 1 - g T,   not below zero

Symbols
-------
    g     loss            of the gain when warm   over the quantity squared   0.02 to 0.3 over the usual one squared (absent 0; below 0 it gains)
    tau   time_constant   of the warming          s                           100 to 10 000 periods
    T                     low-pass filtered square of the quantity

Trace
-----
The same motion needs more drive late in a run than at its beginning, and after a rest less again.

Confused with
-------------
Supply sag (fast, goes with the amount), a drift of the gain with time (does not depend on the
load): runs that begin warm.

Reference
---------
Gill, "Thermal time constants and managing PMAC servo motor overloads", Design World (2018).
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def warm(value: float, warmth: float, loss: float, time_constant: float) -> tuple[float, float]:
    """Return the quantity at the present temperature, and the rate of the temperature."""
    return value * max(1.0 - loss * warmth, 0.0), (value * value - warmth) / time_constant


@dataclass(frozen=True)
class ThermalGain(SeamEffect):
    """A gain that goes with the warmth of past work."""

    name = "thermal_gain"
    block = "seam"
    confused_with = ("supply_sag", "scale", "gain_with_channel")
    acts_on = (INPUT, SEAM)
    states = ("warmth",)
    starts = (0.0,)
    variants = (1.0, 0.2, 5.0)
    varies = "time_constant"
    act = warm

    loss: float = parameter(0.1, "[1/seam^2]", -1.0, 1.0, "of the gain", absent=0.0, smallest=0.02)
    time_constant: float = parameter(1000.0, "[time]", 20.0, 1e6, "of the warming")
