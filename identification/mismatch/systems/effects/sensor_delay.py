"""Sensor delay: a channel is reported later than it was measured.

A receiver computes, a bus waits, a display averages and forwards: the reported value is old.

Equation
--------
    y(t) = y(t - d)

Symbols
-------
    d   delay   s   0.2 to 20 periods of the recording (absent 0)

Trace
-----
The channel trails in proportion to its rate, at every frequency by the same time.

Confused with
-------------
Lag and moving average (round corners), clock offset (may be early as well).

Reference
---------
Bevly, "Global Positioning System (GPS): a low-cost velocity sensor for correcting inertial sensor
errors on ground vehicles", Journal of Dynamic Systems, Measurement and Control 126 (2004).
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.systems.effects.seam_effect import OUTPUT, SeamEffect
from slipbench.plant.parameters import parameter
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class SensorDelay(SeamEffect):
    """A channel that is late."""

    name = "sensor_delay"
    block = "seam"
    confused_with = ("lag", "moving_average", "clock_offset")
    acts_on = (OUTPUT,)

    delay: float = parameter(1.0, "[time]", 0.0, 100.0, "of the channel", absent=0.0, smallest=0.2)

    def late(self, time: Floats) -> Floats:
        """Return the delay, s, (n,)."""
        return np.full(time.shape, self.delay)
