"""Backlash with compliance: part of the inertia is coupled by a spring behind a gap.

A gear train or a coupling first crosses its play, then winds up. Within the gap the driven part
moves alone; beyond it both oscillate.

Equation
--------
    a = (f + m (w^2 D + 2 z w d' [|d| > g])) / (1 - m),   d'' = -w^2 D - 2 z w d' [|d| > g] - a,
    D = d less what the gap takes: max(|d| - g, 0) sign d

Symbols
-------
    m   share       of the inertia behind the gap           1                 0.05 to 0.8 (absent 0)
    w   frequency   of that part with the driven one held   rad/s             in the recorded band
    z   damping     of it, over critical                    1                 0.05 to 0.5
    g   gap         half of the play                        of the distance   0.1 to 2 usual speeds times periods
    d               relative position of the two parts

Trace
-----
After each reversal the driven part is light for a moment, then a blow and ringing; large motion shows
a higher frequency than small.

Confused with
-------------
Elastic load (rings equally at any amplitude), hysteresis (no ringing), dead zone: sweeps at two
amplitudes.

Reference
---------
Nordin, Galic and Gutman, "New models for backlash and gear play", International Journal of Adaptive
Control and Signal Processing 11 (1997) 49 to 63.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import RATE, SeamEffect
from slipbench.plant.parameters import parameter


def strike(
    value: float,
    deflection: float,
    velocity: float,
    share: float,
    frequency: float,
    damping: float,
    gap: float,
) -> tuple[float, float, float]:
    """Return the driven part's acceleration, and the rates of deflection and velocity."""
    wound = deflection - min(max(deflection, -gap), gap)
    touches = 1.0 if wound != 0.0 else 0.0
    spring = frequency * (frequency * wound + 2.0 * damping * velocity * touches)
    driven = (value + share * spring) / (1.0 - share)
    return driven, velocity, -spring - driven


@dataclass(frozen=True)
class ElasticBacklash(SeamEffect):
    """A mode in parallel behind a gap, at the rate of a speed."""

    name = "elastic_backlash"
    block = "seam"
    confused_with = ("elastic_load", "hysteresis", "dead_zone")
    acts_on = (RATE,)
    uses = "of_speed"
    states = ("deflection", "velocity")
    starts = (0.0, 0.0)
    variants = (1.0, 0.5, 0.25, 0.125)
    varies = "frequency"
    act = strike

    share: float = parameter(
        0.4, "1", 0.0, 0.95, "of the inertia behind the gap", absent=0.0, smallest=0.08
    )
    frequency: float = parameter(1.5, "[1/time]", 1e-3, 3.0, "of that part alone, rad/s")
    damping: float = parameter(0.1, "1", 0.002, 2.0, "over critical")
    gap: float = parameter(0.3, "[seam*time^2]", 1e-4, 1e3, "half of the play")
