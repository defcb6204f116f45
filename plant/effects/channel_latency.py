"""Channel latency: values of a channel are older than their time stamps.

Between the moment of measuring and the stamp lie filters of fixed delay, a queue, a gateway from
one bus to another. The whole channel is shifted, with its shape unchanged.

Equation
--------
    reading(t) = value(t - tau)

Symbols
-------
    tau   latency   beyond that of the vehicle file   s   2e-3 to 10e-3 (absent 0)
          channel   which one

Trace
-----
One channel is late against all others, by the same time at every speed, and keeps its corners.

Confused with
-------------
Clock offset (all channels of one clock); lag (rounds corners); relaxation length (falls with
speed): a sharp change, and two speeds.

Reference
---------
Davis, Burns, Bril and Lukkien, "Controller Area Network (CAN) schedulability analysis: refuted,
revisited and revised", Real-Time Systems 35 (2007).
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import parameter, word
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class ChannelLatency(Effect):
    """Age of a channel's values."""

    name = "channel_latency"
    block = "channel"
    stage = "signal"
    shows_in = ("optical_speed", "engine_speed", "throttle_position", "spark_applied")
    confused_with = (
        "clock_offset",
        "channel_lag",
        "relaxation_length",
        "optical_lag",
        "air_box_delay",
        "crank_angle_delay",
        "clock_drift",
        "held_frames",
        "moving_average",
    )

    channel: str = word("optical_speed", "which one")
    latency: float = parameter(
        5e-3, "s", 0.0, 2.0, "beyond that of the vehicle file", absent=0.0, smallest=1.5e-3
    )

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect at its typical size on every channel that may have it."""
        return tuple(cls(channel=channel) for channel in cls.shows_in)

    def measure(self, memory: Floats, time: Floats, value: Floats) -> tuple[Floats, Floats]:
        """Memory (past times and values, shape (2, k)) and delayed values, shape (n,); time in s."""
        past = np.hstack([memory.reshape(2, -1), [time, value]])
        reading = np.interp(time - self.latency, past[0], past[1]) if self.latency > 0.0 else value
        needed = np.searchsorted(past[0], time[-1] - self.latency, side="right") - 1
        return past[:, max(needed, 0) :], reading
