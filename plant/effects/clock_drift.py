"""Clock drift: a device's second is not a second.

A quartz is off by tens of parts in a million, more when it is cold; a ceramic resonator by
thousands. Two recordings that agree at the start are apart at the end.

Equation
--------
    stamp = (1 + delta) t

Symbols
-------
    delta   drift   gain of the clock                    1   20e-6 to 500e-6 (absent 0)
            clock   whose channels are all stamped wrong

Trace
-----
A shift between two clocks that grows in proportion to time: 50 parts in a million are 3 ms a
minute.

Confused with
-------------
Offset and latency (do not grow): compare the beginning of a long recording with its end.

Reference
---------
Mills, "Internet time synchronization: the network time protocol", IEEE Transactions on
Communications 39 (1991); on what a drift must be distinguished from, Allan, "Statistics of atomic frequency
standards", Proceedings of the IEEE 54 (1966).
"""

from dataclasses import dataclass
from typing import Self

from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import parameter, word


@dataclass(frozen=True)
class ClockDrift(Effect):
    """A clock that runs fast or slow."""

    name = "clock_drift"
    block = "channel"
    shows_in = ("optical_speed", "rear_teeth", "front_teeth", "engine_speed")
    confused_with = ("clock_offset", "channel_latency")

    clock: str = word("optical", "whose channels are all stamped wrong")
    drift: float = parameter(
        50e-6, "1", -0.01, 0.01, "gain of the clock", absent=0.0, smallest=10e-6
    )

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect at its typical size on each clock of the default channels."""
        return tuple(cls(clock=clock) for clock in ("optical", "encoder"))

    def clock_error(self, time: float) -> float:
        """Error of the clock in s, positive where it is ahead."""
        return self.drift * time
