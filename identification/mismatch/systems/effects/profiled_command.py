"""Profiled command: a command passes a generator that limits its acceleration.

A motion controller does not hand on a step: it speeds up and slows down with a given acceleration,
and is at rest when it arrives.

Equation
--------
    |y''| <= A,   and so that it can stop in time: |y'| <= sqrt(2 A |f - y|),   f = y

Symbols
-------
    A   limit   greatest acceleration of the command   of the quantity over time squared   (absent infinite)

Trace
-----
A step becomes two parabolas and takes twice the root of its size over A; slow commands pass as they
are.

Confused with
-------------
Rate limit (a straight ramp), braking loop (starts at once), lag (alike for all sizes): steps of
several sizes. Acceleration limit of the moved part: within the loop, not before it.

Reference
---------
"On fast jerk-, acceleration- and velocity-restricted motion functions for online trajectory
generation", Robotics 10 (2021), 25.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def profile(
    value: float, memory: float, second: float, elapsed: float, limit: float
) -> tuple[float, float, float]:
    """Return where the command has come to, twice, and its rate: in eight parts of the time."""
    part = max(0.125 * elapsed, 1e-300)
    most = part * limit
    place, rate = memory, second
    for _ in range(8):
        left = abs(value - place)
        fast = math.sqrt(2.0 * limit * max(left, 1e-300))  # no limit times no way is no number
        wanted = math.copysign(min(left / part, fast), value - place)
        rate = min(max(wanted, rate - most), rate + most)
        place += part * rate
    return place, place, rate


@dataclass(frozen=True)
class ProfiledCommand(SeamEffect):
    """A command with limited acceleration."""

    name = "profiled_command"
    block = "seam"
    confused_with = ("rate_limit", "braking_loop", "lag", "acceleration_limit")
    acts_on = (INPUT, SEAM)
    uses = "of_position"
    remembers = 2
    starts = ("value", 0.0)
    variants = (1.0, 0.1, 0.01, 0.001)
    varies = "limit"
    act = profile

    limit: float = parameter(
        0.03, "[seam/time^2]", 1e-12, 1e9, "greatest acceleration", absent=math.inf, smallest=0.3
    )
