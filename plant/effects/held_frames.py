"""Held frames: a device sends more often than it measures.

Its frames come every few milliseconds, but the value in them is renewed only every so often.
Between two renewals the same number is repeated with fresh stamps.

Equation
--------
    reading(t) = value at the first frame with floor(t / h) = k

Symbols
-------
    h   hold      time between renewals   s   10e-3 to 50e-3 (absent 0)
        channel   which one

Trace
-----
Stairs in time, all of the same length; on average the channel is late by half a hold.

Confused with
-------------
Lag and latency of half the hold (no repeated values); quantiser (stairs of the same height).

Reference
---------
Franklin, Powell and Workman, "Digital Control of Dynamic Systems", 3rd edition (1998), on the
zero-order hold.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from slipbench.plant.channels import latest
from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import parameter, word
from slipbench.plant.signals import Floats
from slipbench.plant.update_times import Renewals


@dataclass(frozen=True)
class HeldFrames(Effect):
    """Values that are renewed less often than they are sent."""

    name = "held_frames"
    block = "channel"
    stage = "frame"
    shows_in = ("engine_speed", "throttle_position", "optical_speed", "spark_applied")
    confused_with = ("quantiser", "stale_frames", "channel_latency", "channel_lag")

    channel: str = word("engine_speed", "which one")
    hold: float = parameter(
        30e-3, "s", 0.0, 5.0, "time between renewals", absent=0.0, smallest=15e-3
    )

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect at its typical size on every channel that may have it."""
        return tuple(cls(channel=channel) for channel in cls.shows_in)

    def measure(self, memory: Floats, time: Floats, value: Floats) -> tuple[Floats, Floats]:
        """Memory [slot, last value] and values as last updated, shape (n,); time in s."""
        if self.hold <= 0.0:
            return memory, value
        slot = np.floor(time / self.hold + 1e-6)
        before = memory if memory.size else np.array([np.nan, value[0]])
        reading = latest(np.diff(slot, prepend=before[0]) != 0.0, before[1], value)
        return np.array([slot[-1], reading[-1]]), reading

    def with_repeats(self, known: Renewals, rhythm: float, time: Floats, value: Floats) -> Floats:
        """Values where it is known which frames were repeated, shape (n,); time in s.

        The error is proportional to the hold; frames repeated at random times are not this effect.
        """
        if not rhythm:
            return value
        measured_hold = rhythm * float(np.median(np.diff(time)))
        return np.asarray(value + known.late * (self.hold / measured_hold))
