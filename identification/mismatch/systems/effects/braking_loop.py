"""Braking loop: a position loop with a square-root law, which stops at its target.

To stop within a distance at a limited deceleration, the speed must not exceed the square root of
twice their product. Servos and flight controllers follow this law instead of a straight gain.

Equation
--------
    y' = sign(e) sqrt(2 A |e|),   e = f - y,   f = y

Symbols
-------
    A   deceleration   that the loop plans with   of the quantity over time squared   (absent infinite)
    e                  remaining distance

Trace
-----
Steps end as parabolas and take a time that grows with the root of their size; there is no overshoot.

Confused with
-------------
Rate limit (a straight ramp to the end), lag (an exponential, the same for all sizes): steps of
several sizes.

Reference
---------
ArduPilot, libraries/AP_Math/control.cpp: `sqrt_controller`.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def approach(
    value: float, memory: float, second: float, elapsed: float, step: float, deceleration: float
) -> tuple[float, float, float]:
    """Return the position, and the memory: the position and the target.

    The root of the distance falls in proportion to time: exact for a held target. A moving target
    moves in the middle of the step (Strang splitting, second order). At the instant of a jump the
    returned value gives the step its true mean by Simpson's rule, as in a rate limit.
    """
    pace = math.sqrt(0.5 * min(deceleration, 1e300))
    if elapsed == 0.0:
        error, falls = abs(value - memory), pace * step
        root = math.sqrt(error)
        if root < falls:
            error = 2.0 * error * root / falls - 4.0 * max(root - 0.5 * falls, 0.0) ** 2
        return value - math.copysign(error, value - memory), memory, value
    error, falls = second - memory, 0.5 * elapsed * pace
    error = math.copysign(max(math.sqrt(abs(error)) - falls, 0.0) ** 2, error) + value - second
    error = math.copysign(max(math.sqrt(abs(error)) - falls, 0.0) ** 2, error)
    return value - error, value - error, value


@dataclass(frozen=True)
class BrakingLoop(SeamEffect):
    """A loop with a square-root law."""

    name = "braking_loop"
    block = "seam"
    confused_with = ("rate_limit", "lag")
    acts_on = (INPUT, SEAM)
    uses = "of_position"
    remembers = 2
    variants = (1.0, 0.1, 0.01, 0.001)
    varies = "deceleration"
    act = approach

    deceleration: float = parameter(
        0.03, "[seam/time^2]", 1e-12, 1e9, "that it plans with", absent=math.inf, smallest=0.3
    )
