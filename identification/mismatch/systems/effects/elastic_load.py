"""Elastic load: part of the inertia is coupled by a spring.

The body consists of two parts. The driven part moves at once; the other follows through a spring
and reacts on it. At the antiresonance the driven part stands still.

Equation
--------
    a = (f + m (w^2 d + 2 z w d')) / (1 - m),   d'' = -w^2 d - 2 z w d' - a

Symbols
-------
    m   share       of the inertia that hangs on the spring    1       0.05 to 0.8 (absent 0)
    w   frequency   of that part with the driven one held      rad/s   in the recorded band
    z   damping     of it, over critical                       1       0.01 to 0.3
    d               deflection of the spring

Trace
-----
A dip at one frequency and a peak above it; steps of the driven part ring.

Confused with
-------------
Lag and friction (no dip): a sweep through the mode.

Reference
---------
Rivin, "Stiffness and damping in mechanical design" (1999), chapter 6; Ellis and Lorenz, "Resonant
load control methods for industrial servo drives", IEEE IAS (2000).
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import RATE, SeamEffect
from slipbench.plant.parameters import parameter


def pull_back(
    value: float, deflection: float, velocity: float, share: float, frequency: float, damping: float
) -> tuple[float, float, float]:
    """Return the driven part's acceleration, and the rates of deflection and velocity."""
    spring = frequency * (frequency * deflection + 2.0 * damping * velocity)
    driven = (value + share * spring) / (1.0 - share)
    return driven, velocity, -spring - driven


@dataclass(frozen=True)
class ElasticLoad(SeamEffect):
    """A mode in parallel, at the rate of a speed."""

    name = "elastic_load"
    block = "seam"
    confused_with = ("elastic_transmission", "lag")
    acts_on = (RATE,)
    states = ("deflection", "velocity")
    starts = (0.0, 0.0)
    variants = (1.0, 0.5, 0.25, 0.125, 0.0625, 0.03125)
    varies = "frequency"
    act = pull_back

    share: float = parameter(
        0.4, "1", 0.0, 0.95, "of the inertia that hangs on the spring", absent=0.0, smallest=0.08
    )
    frequency: float = parameter(1.5, "[1/time]", 1e-3, 3.0, "of that part alone, rad/s")
    damping: float = parameter(0.05, "1", 0.002, 2.0, "over critical")
