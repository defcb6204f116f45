"""Channel scale: a channel is sent in another scale than its database states.

A factor copied wrongly, a sensor of another type, an axis that points backwards: the channel is
right in shape and wrong by a factor.

Equation
--------
    reading = (1 + e) value

Symbols
-------
    e   error     of the factor; -2 is a wrong sign   1   -0.05 to 0.05 (absent 0)
        channel   which one

Trace
-----
A fixed ratio to what other channels imply, at every speed and in every direction.

Confused with
-------------
A wrong parameter of the block in front of the channel (the servo's gain, the gear ratio): a second
channel of the same quantity separates them. A blind counter keeps the size and loses the sign.

Reference
---------
Isermann, "Fault-Diagnosis Systems" (2006), on sensor faults: scale, sign, offset.
"""

from dataclasses import dataclass
from typing import Self

from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import parameter, word
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class ChannelScale(Effect):
    """Error of a channel's factor."""

    name = "channel_scale"
    block = "channel"
    stage = "signal"
    shows_in = ("engine_speed", "throttle_position", "spark_applied")
    confused_with = ("direction_blind_counter",)

    channel: str = word("engine_speed", "which one")
    error: float = parameter(
        0.02, "1", -3.0, 3.0, "of the factor; -2 is a wrong sign", absent=0.0, smallest=5e-3
    )

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect at its typical size on every channel that may have it."""
        return tuple(cls(channel=channel) for channel in cls.shows_in)

    def measure(self, memory: Floats, time: Floats, value: Floats) -> tuple[Floats, Floats]:
        """Memory, unused, and values times the wrong scale factor, shape (n,); time in s."""
        return memory, (1.0 + self.error) * value
