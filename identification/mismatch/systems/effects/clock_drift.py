"""Clock drift: the clock of a channel runs fast or slow.

Quartz is accurate to some 1e-6, cheap oscillators to a fraction of 1e-3; after minutes the error
is milliseconds.

Equation
--------
    y(t) = y(t - r (t - t_0)),   t_0 the middle of the recording

Symbols
-------
    r   rate   by which the clock gains   1   1e-5 to 1e-2 (absent 0)

Trace
-----
The channel is late at one end of the recording and early at the other.

Confused with
-------------
Clock offset (the same at both ends): a long recording.

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
class ClockDrift(SeamEffect):
    """A clock that gains."""

    name = "clock_drift"
    block = "seam"
    confused_with = ("clock_offset",)
    acts_on = (OUTPUT,)

    rate: float = parameter(1e-3, "1", -0.1, 0.1, "by which it gains", absent=0.0, smallest=1e-4)

    def late(self, time: Floats) -> Floats:
        """Return the time gained since the middle of the recording, s, (n,)."""
        return np.asarray(self.rate * (time - 0.5 * (time[0] + time[-1])))
