"""Clock offset: the clock of a channel was set wrong.

Two loggers were started by hand and have independent clocks; one is ahead by an unknown time.

Equation
--------
    y(t) = y(t - o)

Symbols
-------
    o   offset   by which the clock is ahead   s   any (absent 0)

Trace
-----
The channel is that of another moment; shifted, it fits.

Confused with
-------------
A delay (never early), a drift (grows): the beginning against the end.

Reference
---------
Mills, "Computer network time synchronization", 2nd edition (2011), chapter 1.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.systems.effects.seam_effect import OUTPUT, SeamEffect
from slipbench.plant.parameters import parameter
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class ClockOffset(SeamEffect):
    """A clock ahead or behind."""

    name = "clock_offset"
    block = "seam"
    confused_with = ("sensor_delay", "clock_drift")
    acts_on = (OUTPUT,)

    offset: float = parameter(
        2.0, "[time]", -1e6, 1e6, "by which it is ahead", absent=0.0, smallest=0.2
    )

    def late(self, time: Floats) -> Floats:
        """Return the offset, s, (n,)."""
        return np.full(time.shape, self.offset)
