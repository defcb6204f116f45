"""Acceleration limit: a drive has a largest acceleration, whatever the error.

A current limit is a torque limit, and with a given inertia a limit of acceleration. It acts at the
rate of a speed; a saturation of a torque in the model bounds only a part of it.

Equation
--------
    |v'| <= A

Symbols
-------
    A   limit   greatest acceleration   of the speed over time   (absent infinite)

Trace
-----
Large steps begin as parabolas, the same for all; sines become arcs of parabolas where amplitude times
frequency squared is large.

Confused with
-------------
Rate limit (its onset goes with amplitude times frequency): a sweep at two amplitudes. Supply limit
(fades with speed), saturation of a force in the model, jerk limit (rounds the start of a step).

Reference
---------
Deur, Pavkovic, Peric, Jansz and Hrovat, "An electronic throttle control strategy including
compensation of friction and limp-home effects", IEEE Transactions on Industry Applications 40
(2004).
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import RATE, SeamEffect
from slipbench.plant.parameters import parameter


def hold(value: float, limit: float) -> float:
    """Return the limited acceleration."""
    return min(max(value, -limit), limit)


@dataclass(frozen=True)
class AccelerationLimit(SeamEffect):
    """A largest rate of a speed."""

    name = "acceleration_limit"
    block = "seam"
    confused_with = ("rate_limit", "saturation", "supply_limit", "jerk_limit")
    acts_on = (RATE,)
    uses = "of_speed"
    variants = (1.0, 0.3, 0.1, 0.03)
    varies = "limit"
    act = hold

    limit: float = parameter(
        0.3, "[seam]", 1e-9, 1e9, "greatest acceleration", absent=math.inf, smallest=0.6
    )
