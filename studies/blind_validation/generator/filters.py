"""Filters of the sensors themselves, as their data sheets state them.

A crank sensor averages over a part of a turn, an optical one over its window; an analogue input has
a low-pass of first order. A vehicle file states the low-pass as such and the moving mean by its
group delay, half the window. The windows are so short that the mean is indistinguishable from a
delay: 1 ms of engine speed and 10 ms of optical speed are not detected, 3 ms and 20 ms are with 45
and 22 nats. A filter of unstated time is a hidden effect: `channel_lag`, `optical_lag`,
`moving_average`.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import signal

from slipbench.studies.blind_validation.generator.physics import Floats

LAG, MEAN = "lag", "mean"
SHARE = 0.5  # of the sensors that have a filter worth stating
RANGES: Mapping[str, tuple[tuple[str, float, float], ...]] = {
    "throttle_position": ((LAG, 1e-3, 6e-3),),
    "engine_speed": ((LAG, 2e-3, 10e-3), (MEAN, 0.5e-3, 1e-3)),
    "optical_speed": ((LAG, 4e-3, 20e-3), (MEAN, 4e-3, 10e-3)),
}
"""Kind, shortest and longest time (s) of the filters that each channel may have."""


@dataclass(frozen=True)
class Filter:
    """kind: low-pass of first order, or moving mean. time: time constant, or window, s."""

    kind: str
    time: float

    @property
    def group_delay(self) -> float:
        """Delay at low frequency, s."""
        return self.time if self.kind == LAG else 0.5 * self.time


def draw_filters(rng: np.random.Generator) -> dict[str, Filter]:
    """Filters of the sensors that have one, by channel."""
    found = {}
    for channel, choices in RANGES.items():
        kind, low, high = choices[int(rng.integers(len(choices)))]
        chosen = Filter(kind, float(rng.uniform(low, high)))
        if rng.uniform() < SHARE:
            found[channel] = chosen
    return found


def filtered(values: Floats, step: float, chosen: Filter) -> Floats:
    """Values behind a filter that has settled at the first one, shape (n,). step: s."""
    return (low_pass if chosen.kind == LAG else moving_mean)(values, step, chosen.time)


def low_pass(values: Floats, step: float, time: float) -> Floats:
    """Values behind a low-pass of first order, shape (n,). step, time: s."""
    keep = np.exp(-step / time)
    start = [keep * values[0]]
    return np.asarray(signal.lfilter([1.0 - keep], [1.0, -keep], values, zi=start)[0])


def moving_mean(values: Floats, step: float, window: float) -> Floats:
    """Mean over the window (s) that ends at each value, shape (n,). step: s.

    The window need not be a whole number of steps: the integral is that of straight lines between
    the values, so that the mean of a ramp is late by half the window to rounding.
    """
    held = np.concatenate((np.full(int(window / step) + 2, values[0]), values))
    integral = step * np.concatenate(([0.0], np.cumsum(0.5 * (held[1:] + held[:-1]))))
    begin = np.arange(held.size) - window / step
    first = np.maximum(np.floor(begin).astype(np.int64), 0)
    part = np.maximum(begin - first, 0.0)
    after = np.minimum(first + 1, held.size - 1)
    begun = held[first] + 0.5 * part * (held[after] - held[first])
    mean = (integral - integral[first] - step * part * begun) / window
    return np.asarray(mean[held.size - values.size :])
