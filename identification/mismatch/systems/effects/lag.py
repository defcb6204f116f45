"""Lag: a quantity follows its command with a first-order time constant.

A winding builds up current, a filter smooths, a mass warms: the output follows the input late.

Equation
--------
    s' = (f - s) / tau,   f = s

Symbols
-------
    tau   time_constant   s   0.3 to 30 periods of the recording (absent 0)
    s                     output of the lag

Trace
-----
Fast motion is smaller and later, in proportion to its rate; corners are rounded.

Confused with
-------------
Delay (keeps the corners), an elastic transmission (overshoots): a step.

Reference
---------
Franklin, Powell and Emami-Naeini, "Feedback control of dynamic systems", 5th edition (2006),
chapter 3.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def trail(value: float, trailing: float, time_constant: float, step: float) -> tuple[float, float]:
    """Return the lagged value and the rate of the state; lags below a step to first order."""
    pace = max(time_constant, step)
    behind = value - trailing
    return value - behind * (time_constant / pace), behind / pace


@dataclass(frozen=True)
class Lag(SeamEffect):
    """First-order smoothing."""

    name = "lag"
    block = "seam"
    confused_with = ("delay", "sensor_delay", "elastic_transmission")
    states = ("trailing",)
    starts = ("value",)
    act = trail

    time_constant: float = parameter(
        2.0, "[time]", 0.0, 200.0, "of the smoothing", absent=0.0, smallest=0.4
    )
