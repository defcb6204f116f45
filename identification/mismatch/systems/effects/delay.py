"""Delay: a quantity acts after a dead time.

A bus, a processor or a pipe outputs its input after some time.

Equation
--------
    f(t) = f(t - d)

Symbols
-------
    d   delay   s   0.2 to 20 periods of the recording (absent 0)

Trace
-----
Phase falls in proportion to frequency, amplitude stays; steps keep their corners.

Confused with
-------------
Lag (rounds the corners): a step. A clock offset (of one channel against all others).

Reference
---------
Franklin, Powell and Workman, "Digital control of dynamic systems", 3rd edition (1998), chapter 4.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def wait(value: float, past: float) -> float:
    """Return the past value."""
    return past


@dataclass(frozen=True)
class Delay(SeamEffect):
    """A pure delay."""

    name = "delay"
    block = "seam"
    confused_with = ("lag", "sensor_delay")
    acts_on = (INPUT, SEAM)
    delay_parameter = "delay"
    act = wait

    delay: float = parameter(1.0, "[time]", 0.0, 100.0, "of the quantity", absent=0.0, smallest=0.2)
