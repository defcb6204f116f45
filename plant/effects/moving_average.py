"""Moving average: a channel is the mean of the measured quantity over a window.

An ECU averages the engine speed over a turn of the crank, an optical sensor its speed over a fixed
time, a logger over the samples that it leaves out.

Equation
--------
    reading(t) = (1 / T) integral of value over the window from t - T to t

Symbols
-------
    T   window    over which the channel averages   s   10e-3 to 0.1 (absent 0)
        channel   which one

Trace
-----
One channel trails by half of the window; motion with the window as its period is missing in it.

Confused with
-------------
Latency (keeps fast motion) and lag (keeps a little of it): a sweep beyond one over the window.

Reference
---------
Oppenheim and Schafer, "Discrete-time signal processing", 3rd edition (2010), section 2.6: frequency
response of the moving average.
"""

from dataclasses import dataclass
from typing import Self

import numpy as np

from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import parameter, word
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class MovingAverage(Effect):
    """A channel that averages over a window."""

    name = "moving_average"
    block = "channel"
    stage = "signal"
    shows_in = ("engine_speed", "optical_speed", "throttle_position")
    confused_with = ("channel_latency", "channel_lag", "optical_lag")

    channel: str = word("engine_speed", "which one")
    window: float = parameter(
        20e-3, "s", 0.0, 2.0, "over which the channel averages", absent=0.0, smallest=10e-3
    )

    @classmethod
    def candidates(cls) -> tuple[Self, ...]:
        """The effect at its typical size on every channel that may have it."""
        return tuple(cls(channel=channel) for channel in cls.shows_in)

    def measure(self, memory: Floats, time: Floats, value: Floats) -> tuple[Floats, Floats]:
        """Memory (past times and values, shape (2, k)) and mean values, shape (n,); time in s.

        Straight lines between samples; before the first sample its value.
        """
        past = np.hstack([memory.reshape(2, -1), [time, value]])
        if self.window <= 0.0:
            return past[:, -1:], value
        begin = time - self.window
        reading = (_integral(past, time) - _integral(past, begin)) / self.window
        needed = np.searchsorted(past[0], begin[-1], side="right") - 1
        return past[:, max(needed, 0) :], reading


def _integral(line: Floats, until: Floats) -> Floats:
    """Integral of straight lines between points (2, k), from the first point on, shape (n,)."""
    time, value = line
    before = np.clip(np.searchsorted(time, until, side="right") - 1, 0, None)
    widths = np.maximum(np.diff(time), 1e-300)
    slopes = np.append(np.diff(value) / widths, 0.0)
    areas = np.concatenate(([0.0], np.cumsum(0.5 * (value[1:] + value[:-1]) * np.diff(time))))
    part = until - time[before]
    slope = np.where(part > 0.0, slopes[before], 0.0)
    return np.asarray(areas[before] + part * (value[before] + 0.5 * slope * part))
