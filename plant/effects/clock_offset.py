"""Clock offset: a device's clock was set to another time.

Loggers and sensors start their clocks when they are switched on, or are set by hand. All that they
stamp is early or late by the same time.

Equation
--------
    stamp = t + delta

Symbols
-------
    delta   offset   of the clock, positive is ahead      s   any; 2e-3 to 60 (absent 0)
            clock    whose channels are all stamped wrong

Trace
-----
All channels of one clock are shifted against all others, by the same time from start to end.

Confused with
-------------
Latency of a channel (that one alone); drift (grows).

Reference
---------
Mills, "Internet time synchronization: the network time protocol", IEEE Transactions on
Communications 39 (1991).
"""

from dataclasses import dataclass
from typing import Self

from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import parameter, word


@dataclass(frozen=True)
class ClockOffset(Effect):
    """A clock that is ahead or behind."""

    name = "clock_offset"
    block = "channel"
    shows_in = ("optical_speed", "rear_teeth", "front_teeth", "engine_speed")
    confused_with = ("channel_latency", "clock_drift")

    clock: str = word("optical", "whose channels are all stamped wrong")
    offset: float = parameter(
        5e-3, "s", -1e5, 1e5, "of the clock, positive is ahead", absent=0.0, smallest=1.5e-3
    )

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect at its typical size on each clock of the default channels."""
        return tuple(cls(clock=clock) for clock in ("optical", "encoder"))

    def clock_error(self, time: float) -> float:
        """Error of the clock in s, positive where it is ahead."""
        return self.offset
