"""Rate limit: a quantity has a largest rate of change.

Causes are the top speed of a motor, the slew rate of an amplifier or the ramp of a controller.

Equation
--------
    |f'| <= R

Symbols
-------
    R   limit   of the rate   of the quantity over time   (absent infinite)

Trace
-----
Steps become ramps, large sines become triangles; small motion is as it was.

Confused with
-------------
Lag (small motion too): two amplitudes at one frequency.

Reference
---------
Gelb and Vander Velde, "Multiple-input describing functions" (1968), chapter 2.
"""

import math
from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, SEAM, SeamEffect
from slipbench.plant.parameters import parameter


def ramp(
    value: float,
    memory: float,
    second: float,
    elapsed: float,
    step: float,
    limit: float,
    period: float,
) -> tuple[float, float, float]:
    """Return the limited value, and the memory: that and the value that it follows.

    Exact for a value that moves linearly from `second`: where the two meet within a step, the
    output follows it from there on. At the instant of a jump the returned value gives the step its
    true mean by Simpson's rule: a ramp shorter than the step would otherwise act a sixth of a step
    late.
    """
    rate = min(limit, 1e290) / period
    if elapsed == 0.0:
        behind, most = abs(value - memory), rate * step
        mean = behind - 0.5 * most if behind > most else 0.5 * behind * behind / most
        start = 6.0 * mean - 4.0 * max(behind - 0.5 * most, 0.0) - max(behind - most, 0.0)
        return value - math.copysign(start, value - memory), memory, value
    way, most = math.copysign(1.0, second - memory), rate * elapsed
    behind, ahead = abs(second - memory), way * (value - second)
    left = behind + ahead - most
    if left < 0.0:
        left = min(ahead + most, 0.0) * (1.0 - behind / (most - ahead))
    new = value - way * left
    return new, new, value


@dataclass(frozen=True)
class RateLimit(SeamEffect):
    """A largest rate."""

    name = "rate_limit"
    block = "seam"
    confused_with = ("lag", "saturation")
    acts_on = (INPUT, SEAM)
    remembers = 2
    act = ramp

    limit: float = parameter(
        0.15, "[seam]", 1e-5, 1e9, "largest change within a period", absent=math.inf, smallest=0.5
    )
    period: float = parameter(1.0, "[time]", 1e-9, 1e9, "time in which that change is allowed")
