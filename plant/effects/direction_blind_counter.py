"""Direction-blind counter: pulses are counted, but the direction of rotation is not measured.

One pickup on one toothed disc gives the same pulses forwards and backwards. What is reported is the
size of the speed.

Equation
--------
    reading = value + b (|value| - value)

Symbols
-------
    b   blindness   1 sends the magnitude only   1   1 (absent 0)
        channel     which one

Trace
-----
The sign is lost: near zero the signal bounces off instead of crossing, and there the residual is
twice the value.

Confused with
-------------
A wrong sign or scale (all the time, not only backwards).

Reference
---------
Wigren and Schoukens, "Coupled electric drives data set and reference models", Uppsala University
technical report (2017): a pulse counter that does not sense the direction.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import parameter, word
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class DirectionBlindCounter(Effect):
    """A speed measured without its sign."""

    name = "direction_blind_counter"
    block = "channel"
    stage = "signal"
    shows_in = ("engine_speed",)
    confused_with = ("channel_scale",)

    channel: str = word("engine_speed", "which one")
    blindness: float = parameter(
        1.0, "1", 0.0, 1.0, "1 sends the magnitude only", absent=0.0, smallest=0.5
    )

    def measure(self, memory: Floats, time: Floats, value: Floats) -> tuple[Floats, Floats]:
        """Memory, unused, and values without their sign, shape (n,); time in s."""
        return memory, value + self.blindness * (np.abs(value) - value)
