"""Channel lag: a channel is low-pass filtered before it is sent.

A device averages its readings so that a display does not flicker. What it reports trails what there
is, with the corners rounded.

Equation
--------
    s' = (value - s) / tau,   exact for straight lines between samples

Symbols
-------
    tau   time_constant   of the smoothing     s   5e-3 to 60e-3 (absent 0)
    s                     sent value
          channel         which one

Trace
-----
One channel trails in proportion to its own rate; fast motion is smaller in it.

Confused with
-------------
Latency (keeps the corners) and moving average (has an end): a sharp change. Relaxation length
(falls with speed): two speeds.

Reference
---------
Franklin, Powell and Workman, "Digital Control of Dynamic Systems", 3rd edition (1998), chapter 6,
on hold equivalents.
"""

import math
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Self

import numpy as np

from slipbench.plant.compiled import entry, load, text_of
from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import parameter, word
from slipbench.plant.signals import Floats


def trail(memory: Floats, time: Floats, value: Floats, time_constant: float) -> Floats:
    """Lagged values, shape (n,). memory: time, value and output of the previous sample.

    time: s, shape (n,); value: shape (n,); time_constant: s.
    """
    reading = np.empty(len(value))
    t, v, s = memory[0], memory[1], memory[2]
    for i in range(len(value)):
        dt = time[i] - t
        if dt > 0.0:
            behind = time_constant * (value[i] - v) / dt
            s = value[i] - behind + (s - v + behind) * math.exp(-dt / time_constant)
        t, v = time[i], value[i]
        reading[i] = s
    return reading


@cache
def _compiled() -> ModuleType:
    return load(entry(text_of(trail), "f8[::1](f8[::1],f8[::1],f8[::1],f8)"))


@dataclass(frozen=True)
class ChannelLag(Effect):
    """First-order smoothing of a channel."""

    name = "channel_lag"
    block = "channel"
    stage = "signal"
    shows_in = ("engine_speed", "throttle_position")
    confused_with = (
        "channel_latency",
        "relaxation_length",
        "optical_lag",
        "held_frames",
        "moving_average",
    )

    channel: str = word("engine_speed", "which one")
    time_constant: float = parameter(
        20e-3, "s", 0.0, 2.0, "of the smoothing", absent=0.0, smallest=4e-3
    )

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect at its typical size on every channel that may have it."""
        return tuple(cls(channel=channel) for channel in cls.shows_in)

    def measure(self, memory: Floats, time: Floats, value: Floats) -> tuple[Floats, Floats]:
        """Memory [time, value, output] and lagged values, shape (n,); time in s. No lag at the start."""
        if self.time_constant <= 0.0:
            return memory, value
        before = memory if memory.size else np.array([time[0], value[0], value[0]])
        t, v = (np.ascontiguousarray(x, dtype=np.float64) for x in (time, value))
        reading: Floats = _compiled().trail(before, t, v, self.time_constant)
        return np.array([t[-1], v[-1], reading[-1]]), reading
