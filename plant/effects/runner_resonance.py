"""Runner resonance: the air in box and runners swings like a mass on a spring.

The box is a volume, the runner a plug of air: a Helmholtz resonator. Where the throttle excites it,
the cylinder gets more or less air than the lag alone would give.

Equation
--------
    y'' = w^2 (air - y) - 2 z w y';   charge = air + g (y - air)

Symbols
-------
    g   share       of the air that goes through the resonator   1       0.2 to 1 (absent 0)
    w   frequency   of the mode                                  rad/s   2 pi 25 to 2 pi 60
    z   damping     of the mode                                  1       0.1 to 0.3
    y   swing       what the resonator passes (a state)          1
        swing_rate  its rate (a state)                           1/s

Trace
-----
A peak at one frequency in the response from the throttle, not from the spark, in every gear.

Confused with
-------------
The mode of the driveline, which moves with the gear and also answers to the spark.

Reference
---------
Heywood, "Internal Combustion Engine Fundamentals" (1988), chapter 7, on intake manifolds; Engelman,
"Design of a tuned intake manifold", ASME 73-WA/DGP-2 (1973).
"""

import math
from dataclasses import dataclass

from slipbench.plant.effects.effect import Effect, Hook
from slipbench.plant.parameters import parameter


def swing_along(
    charge: float,
    air: float,
    swing: float,
    swing_rate: float,
    share: float,
    frequency: float,
    damping: float,
) -> tuple[float, float, float]:
    """The charge, and rates of the swing [1/s] and of its rate [1/s^2]."""
    push = frequency * (frequency * (air - swing) - 2.0 * damping * swing_rate)
    return charge + share * (swing - air), swing_rate, push


@dataclass(frozen=True)
class RunnerResonance(Effect):
    """Helmholtz mode of air box and runners."""

    name = "runner_resonance"
    block = "intake"
    shows_in = ("engine_speed", "rear_teeth")
    confused_with = ("hardening_cush",)
    states = ("swing", "swing_rate")
    starts = (0.08, 0.0)
    hooks = (Hook("charge", swing_along, governs=("swing", "swing_rate")),)

    share: float = parameter(
        0.6, "1", 0.0, 1.5, "of the air through the resonator", absent=0.0, smallest=0.15
    )
    frequency: float = parameter(
        2 * math.pi * 35, "rad/s", 2 * math.pi * 5, 2 * math.pi * 150, "frequency of the mode"
    )
    damping: float = parameter(0.15, "1", 0.02, 2.0, "damping ratio of the mode")
