"""Supply sag: the load of a drive lowers the gain of its supply.

A battery has resistance and a slower part behind it; a pressure line has loss and a reservoir. The
load lowers the supply with some delay, and the supply recovers at rest.

Equation
--------
    s' = (|f| - s) / tau,   f *= 1 - r s,   not below zero

Symbols
-------
    r     sag             of the gain for each unit drawn   over the quantity   0.03 to 0.5 over the usual one (absent 0)
    tau   time_constant   of the sag                        s                   3 to 300 periods
    s                     recent load

Trace
-----
The response to large motion fades within tau and comes back after a pause.

Confused with
-------------
Thermal gain (goes with the square, takes minutes); saturation (at once, and a ceiling); gain with a
channel, where the supply was recorded: large steps with pauses of several lengths.

Reference
---------
Hu, Zanchi and Zhao, "Determining battery parameters by simple algebraic method", American Control
Conference (2011): Thevenin circuit of a battery.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def sink(value: float, drawn: float, sag: float, time_constant: float) -> tuple[float, float]:
    """Return the quantity at the sagged supply, and the rate of the recent load."""
    return value * max(1.0 - sag * drawn, 0.0), (abs(value) - drawn) / time_constant


@dataclass(frozen=True)
class SupplySag(SeamEffect):
    """A gain that falls with what was drawn lately."""

    name = "supply_sag"
    block = "seam"
    confused_with = ("thermal_gain", "saturation", "gain_with_channel")
    acts_on = (INPUT, SEAM)
    states = ("drawn",)
    starts = (0.0,)
    variants = (1.0, 0.1, 10.0)
    varies = "time_constant"
    act = sink

    sag: float = parameter(0.2, "[1/seam]", 0.0, 2.0, "of the gain", absent=0.0, smallest=0.04)
    time_constant: float = parameter(30.0, "[time]", 1.0, 1e5, "of the sag")
