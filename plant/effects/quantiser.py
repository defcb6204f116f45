"""Quantiser: a channel is sent in coarser steps than its database states.

The number passes through a shorter word somewhere: an eight-bit converter, a byte on an inner bus.
It keeps its period and loses its fine steps.

Equation
--------
    reading = q round(value / q)

Symbols
-------
    q   quantum   step that is sent, in the channel's unit   (absent 0)
        channel   which one

Trace
-----
Few distinct values, a whole number of steps apart; slow motion becomes a staircase, and fast
motion gains white noise of q over the root of 12.

Confused with
-------------
Held or stale frames (repeated values as well, but any values, not whole steps).

Reference
---------
Widrow and Kollar, "Quantization Noise" (2008).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Self

from slipbench.plant.channels import quantised
from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import parameter, word
from slipbench.plant.signals import Floats

EIGHT_BITS: Mapping[str, float] = MappingProxyType(
    {"engine_speed": 6.0, "throttle_position": 4e-3, "optical_speed": 0.3, "spark_applied": 3e-3}
)
"""The whole range of a channel in 256 steps, in its SI unit."""


@dataclass(frozen=True)
class Quantiser(Effect):
    """A short word on the way of a channel."""

    name = "quantiser"
    block = "channel"
    stage = "frame"
    shows_in = tuple(EIGHT_BITS)
    confused_with = ("held_frames", "stale_frames")

    channel: str = word("engine_speed", "which one")
    quantum: float = parameter(
        6.0, "", 0.0, 1e6, "step that is sent, in the channel's unit", absent=0.0, smallest=1.5
    )

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect of eight bits on every channel that may have it."""
        return tuple(cls(channel, quantum) for channel, quantum in EIGHT_BITS.items())

    def measure(self, memory: Floats, time: Floats, value: Floats) -> tuple[Floats, Floats]:
        """Memory, unused, and values rounded to the quantum, shape (n,); time in s."""
        return memory, quantised(value, self.quantum)
