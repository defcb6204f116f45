"""Low-speed dropout: a pulse sensor gives no reading while the pulses come too slowly.

The voltage of a passive sensor goes with speed and falls below its threshold; a counter that waits for
the next tooth gives up and reads zero while the wheel creeps on.

Equation
--------
    y *= r^8 / (1 + r^8),   r = |y| / w

Symbols
-------
    w   threshold   speed below which it reads 0   of the quantity   0.02 to 0.5 of it (absent 0)

Trace
-----
Slow motion reads as rest, and starts and stops are steep; fast motion is as it was.

Confused with
-------------
Dead zone (large values are smaller as well), friction (the motion itself stops): a second sensor, or
integrating the speed to a known distance.

Reference
---------
Stagramer, "Rotation speed sensor: basic knowledge": the signal of variable reluctance is the change
that a passing tooth makes.
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import OUTPUT, SeamEffect
from slipbench.plant.parameters import parameter


def tell(value: float, threshold: float) -> float:
    """Return the reading."""
    if abs(value) >= 1e3 * threshold:
        return value
    r = (value / threshold) ** 8
    return value * (r / (1.0 + r))  # in this order, rounding never makes it exceed the value


@dataclass(frozen=True)
class LowSpeedDropout(SeamEffect):
    """A threshold below which a sensor gives no reading."""

    name = "low_speed_dropout"
    block = "seam"
    confused_with = ("dead_zone", "friction")
    acts_on = (OUTPUT,)
    act = tell

    threshold: float = parameter(
        0.1, "[seam]", 0.0, 3.0, "speed below which nothing is told", absent=0.0, smallest=0.03
    )
