"""Hysteresis: play between input and output.

A gear with clearance, a ratchet, magnetised iron: after a reversal the output rests until the
play has been crossed.

Equation
--------
    p = min(max(p, f - w), f + w),   f = p

Symbols
-------
    w   play   half of the clearance   of the quantity   0.02 to 1 of it (absent 0)
    p          transmitted quantity

Trace
-----
Every reversal leaves a pause; the way up and the way down differ by the play at any speed.

Confused with
-------------
Lag (the difference grows with speed), dead zone (the pause is at zero, not at the reversal).

Reference
---------
Nordin and Gutman, "Controlling mechanical systems with backlash: a survey", Automatica 38 (2002).
"""

from dataclasses import dataclass

from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import parameter


def follow(value: float, memory: float, play: float) -> tuple[float, float]:
    """Return the transmitted quantity twice: it is also the memory."""
    new = min(max(memory, value - play), value + play)
    return new, new


@dataclass(frozen=True)
class Hysteresis(SeamEffect):
    """A clearance."""

    name = "hysteresis"
    block = "seam"
    confused_with = ("dead_zone", "friction", "lag")
    remembers = 1
    act = follow

    play: float = parameter(
        0.15, "[seam]", 0.0, 3.0, "half of the clearance", absent=0.0, smallest=0.03
    )
