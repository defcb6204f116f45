"""Elastic transmission: a quantity is transmitted through a resonance.

A belt, a shaft or a hose is a spring with a mass behind it: the output lags and rings.

Equation
--------
    s'' = w^2 (f - s) - 2 z w s',   f += c (s - f)

Symbols
-------
    c   share       of the quantity that goes through it   1       0.2 to 1 (absent 0)
    w   frequency   of the mode                            rad/s   up to half the recorded band
    z   damping     of it, over critical                   1       0.01 to 0.5

Trace
-----
A peak at one frequency, and less above it; steps ring.

Confused with
-------------
Lag (no overshoot); an elastic load (has a dip below its peak): a sweep through the mode.

Reference
---------
Rivin, "Stiffness and damping in mechanical design" (1999), chapter 6.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def swing(
    value: float, position: float, velocity: float, share: float, frequency: float, damping: float
) -> tuple[float, float, float]:
    """Return the transmitted quantity, and the rates of position and velocity."""
    push = frequency * (frequency * (value - position) - 2.0 * damping * velocity)
    return value + share * (position - value), velocity, push


@dataclass(frozen=True)
class ElasticTransmission(SeamEffect):
    """A mode in series."""

    name = "elastic_transmission"
    block = "seam"
    confused_with = ("lag", "delay", "elastic_load")
    acts_on = (INPUT, SEAM)
    states = ("position", "velocity")
    starts = ("value", 0.0)
    variants = (1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125)
    varies = "frequency"
    act = swing

    share: float = parameter(
        1.0, "1", 0.0, 1.25, "of the quantity that goes through it", absent=0.0, smallest=0.2
    )
    frequency: float = parameter(1.5, "[1/time]", 1e-3, 3.0, "of the mode, rad/s")
    damping: float = parameter(0.1, "1", 0.002, 2.0, "over critical")
