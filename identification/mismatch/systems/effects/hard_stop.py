"""Hard stop: the travel of a position is limited.

A throttle plate, a cylinder, a steering rack meets its end and bounces. The stop pushes and never
pulls; it is as stiff as the step of the simulation allows.

Equation
--------
    a -= max(w^2 p + 2 z w s v, 0) s,   p = |x| - L above 0,   s = sign x,   w = 1 / (4 steps)

Symbols
-------
    L   limit     position of both stops                of the position   0.5 to 1.2 of the usual one (absent infinite)
    z   damping   of the contact, over critical          1                 0.05 to 1
    x             position: the state whose rate is the speed
    v             the speed

Trace
-----
Positions end at one level with blows; below it everything is as it was.

Confused with
-------------
Saturation of a sensor (the drive goes on beyond it, and comes back late), cubic (grows smoothly).

Reference
---------
Nordin, Galic and Gutman, "New models for backlash and gear play", International Journal of Adaptive
Control and Signal Processing 11 (1997) 49 to 63: contact of a spring with damping that never pulls.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import RATE, SeamEffect
from slipbench.plant.parameters import parameter


def bounce(
    value: float, other: float, rate_of: float, step: float, limit: float, damping: float
) -> float:
    """Return the acceleration plus that of the contact."""
    deep = abs(other) - limit
    if deep <= 0.0:
        return value
    side = math.copysign(1.0, other)
    w = 0.25 / step
    return value - side * max(w * (w * deep + 2.0 * damping * side * rate_of), 0.0)


@dataclass(frozen=True)
class HardStop(SeamEffect):
    """Ends of the travel."""

    name = "hard_stop"
    block = "seam"
    confused_with = ("saturation", "cubic")
    acts_on = (RATE,)
    uses = "position"
    act = bounce

    limit: float = parameter(
        1.0, "[other]", 1e-3, 1e9, "where the stop stands", absent=math.inf, smallest=2.0
    )
    damping: float = parameter(0.3, "1", 0.0, 2.0, "of the contact, over critical")
