"""Held samples: a channel is transmitted more often than it is measured.

A gateway repeats the last value until a new one comes; a slow sensor sits on a fast bus.

Equation
--------
    y(t) = y(t_k),   t_k the last time at which (t + p T / 2 pi) / T was an integer

Symbols
-------
    T   hold    time between measurements   s     2 to 20 periods of the recording (absent 0)
    p   phase   of the measurements         rad

Trace
-----
The channel goes in stairs of one length; on average it is late by half of it.

Confused with
-------------
Sensor delay (no stairs), lag (rounds corners): compare the values of neighbouring samples.

Reference
---------
Astrom and Wittenmark, "Computer-controlled systems", 3rd edition (1997), section on the zero-order
hold.
"""

import math
from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.systems.effects.seam_effect import OUTPUT, SeamEffect
from slipbench.plant.parameters import parameter
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class HeldSamples(SeamEffect):
    """A channel that repeats its values."""

    name = "held_samples"
    block = "seam"
    confused_with = ("sensor_delay", "lag")
    acts_on = (OUTPUT,)

    hold: float = parameter(
        4.0, "[time]", 0.0, 100.0, "between measurements", absent=0.0, smallest=1.0
    )
    phase: float = parameter(0.0, "rad", -math.pi, math.pi, "of the measurements")

    def late(self, time: Floats) -> Floats:
        """Return the age of the held sample at these times, s, (n,)."""
        if self.hold <= 0.0:
            return np.zeros(time.shape)
        return np.asarray(np.mod(time + self.phase / (2.0 * math.pi) * self.hold, self.hold))
