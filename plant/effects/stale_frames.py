"""Stale frames: now and then a frame repeats the value before it.

Sender and bus have two clocks that slip against each other, or a task overran: the frame goes out
before its value has been renewed. The next one is right again.

Equation
--------
    told_k = told_{k-1} with probability p, else value_k

Symbols
-------
    p   share     of the frames that are stale    1   0.01 to 0.2 (absent 0)
        seed      of the draw                     1   0
        channel   which one

Trace
-----
Single repeated values at irregular places, an error in proportion to the rate.

Confused with
-------------
Held frames (regular); quantiser (repeats only where little moves).

Reference
---------
Tindell, Hansson and Wellings, "Analysing real-time communications: Controller Area Network (CAN)",
IEEE Real-Time Systems Symposium (1994), on jitter and overwritten messages.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from slipbench.plant.channels import latest
from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import parameter, word
from slipbench.plant.signals import Floats
from slipbench.plant.update_times import Renewals


def draw(first: int, count: int, seed: int) -> Floats:
    """Pseudo-random numbers in 0..1, shape (count,), from index and seed alone (splitmix64)."""
    with np.errstate(over="ignore"):
        z = np.arange(first, first + count).astype(np.uint64) + np.uint64(seed << 32)
        z = (z + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return (z ^ (z >> np.uint64(31))).astype(np.float64) / 2.0**64


@dataclass(frozen=True)
class StaleFrames(Effect):
    """Frames that repeat the one before."""

    name = "stale_frames"
    block = "channel"
    stage = "frame"
    shows_in = ("engine_speed", "throttle_position", "optical_speed", "spark_applied")
    confused_with = ("held_frames", "quantiser")

    channel: str = word("engine_speed", "which one")
    share: float = parameter(
        0.1, "1", 0.0, 0.95, "of the frames that are stale", absent=0.0, smallest=0.02
    )
    seed: float = parameter(0, "1", 0, 2**31 - 1, "of the draw", whole=True)

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect at its typical size on every channel that may have it."""
        return tuple(cls(channel=channel) for channel in cls.shows_in)

    def measure(self, memory: Floats, time: Floats, value: Floats) -> tuple[Floats, Floats]:
        """Memory [frames so far, sent value] and the values, some of them repeated."""
        before = memory if memory.size else np.array([0.0, value[0]])
        first = int(before[0])
        reading = latest(draw(first, len(value), int(self.seed)) >= self.share, before[1], value)
        return np.array([first + len(value), reading[-1]]), reading

    def with_repeats(self, known: Renewals, rhythm: float, time: Floats, value: Floats) -> Floats:
        """Mean values where it is known which frames were repeated, shape (n,); time in s.

        The expected share of them is stale; frames repeated periodically are not stale.
        """
        return value + known.late * (0.0 if rhythm else self.share / known.share)
