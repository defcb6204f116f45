"""Jerk limit: acceleration changes at a limited rate.

A motion controller ramps its acceleration to spare gears and passengers; a current loop needs time
to turn the current over.

Equation
--------
    |v''| <= J

Symbols
-------
    J   limit   greatest change of the acceleration within a period   of the acceleration   (absent infinite)

Trace
-----
Steps begin as cubic parabolas; the acceleration is made of ramps. Small motion is as it was.

Confused with
-------------
Lag (small motion too), acceleration limit (the ramp ends at a level): steps of two sizes.

Reference
---------
"On fast jerk-, acceleration- and velocity-restricted motion functions for online trajectory
generation", Robotics 10 (2021), 25.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.rate_limit import ramp
from slipbench.identification.mismatch.systems.effects.seam_effect import RATE, SeamEffect
from slipbench.plant.parameters import parameter


@dataclass(frozen=True)
class JerkLimit(SeamEffect):
    """A largest change of acceleration."""

    name = "jerk_limit"
    block = "seam"
    confused_with = ("lag", "acceleration_limit", "rate_limit")
    acts_on = (RATE,)
    uses = "of_speed"
    remembers = 2
    variants = (1.0, 0.3, 0.1, 0.03)
    varies = "limit"
    act = ramp

    limit: float = parameter(
        0.1, "[seam]", 1e-9, 1e9, "largest change within a period", absent=math.inf, smallest=0.3
    )
    period: float = parameter(
        1.0, "[time]", 1e-9, 1e9, "time in which that change is allowed", given=True
    )
