"""Sampling of a quantity between the motorcycle and the wire: clock, period, latency, quantum.

The plant only keeps these figures and samples with them; noise is added by whoever owns the seed.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from slipbench.plant.parameters import Block, parameter
from slipbench.plant.signals import Floats

CHANNEL_UNITS: Mapping[str, str] = MappingProxyType(
    {
        "throttle_command": "1",
        "throttle_position": "1",
        "spark_command": "rad",
        "spark_applied": "rad",
        "engine_speed": "rad/s",
        "rear_teeth": "s",
        "front_teeth": "s",
        "optical_speed": "m/s",
        "gear": "1",
        "suspension_travel": "m",
        "rider": "1",
        "temperatures": "K",
    }
)
"""The channels of a trial and the SI unit of each."""


@dataclass(frozen=True)
class ChannelTiming(Block):
    """How one channel is sampled. quantum and noise are in the channel's own SI unit.

    clock  which clock stamps it; channels with one clock share its offset and drift
    """

    clock: str = field(default="ecu")
    period: float = parameter(10e-3, "s", 0.0, 10.0, "between samples; 0 sends every event")
    latency: float = parameter(2e-3, "s", 0.0, 1.0, "from the moment it holds for to the wire")
    quantum: float = parameter(0.0, "", 0.0, 1e3, "smallest step that is sent; 0: no rounding")
    noise: float = parameter(0.0, "", 0.0, 1e3, "standard deviation of white noise")
    clock_offset: float = parameter(0.0, "s", -1e3, 1e3, "of its clock at the start")
    clock_drift: float = parameter(0.0, "1", -1e-3, 1e-3, "gain of its clock")


MOST_SPREAD = 0.8
"""Noise in quanta above which rounding shows no more."""
HARMONICS = 8
TENTH_DEGREE = math.pi / 1800
_STATED = ChannelTiming()
DEFAULT_CHANNELS: Mapping[str, ChannelTiming] = MappingProxyType(
    {
        "throttle_command": replace(_STATED, quantum=1e-4),
        "throttle_position": replace(_STATED, quantum=1e-3, noise=3e-4),
        "spark_command": replace(_STATED, quantum=TENTH_DEGREE),
        "spark_applied": replace(_STATED, quantum=TENTH_DEGREE),
        "engine_speed": replace(_STATED, quantum=math.pi / 30, noise=0.3),
        "rear_teeth": replace(_STATED, clock="encoder", period=0.0, quantum=1e-6),
        "front_teeth": replace(_STATED, clock="encoder", period=0.0, quantum=1e-6),
        "optical_speed": replace(_STATED, clock="optical", period=4e-3, quantum=0.01, noise=0.02),
        "gear": replace(_STATED, period=0.1, quantum=1.0),
        "suspension_travel": replace(_STATED, quantum=1e-4, noise=2e-4),
        "rider": _STATED,
        "temperatures": replace(_STATED, period=1.0, quantum=1.0),
    }
)
"""Timing of a channel that a vehicle file does not mention."""


def sample(
    time: Floats, values: Floats, timing: ChannelTiming, start: float = 0.0
) -> tuple[Floats, Floats]:
    """Sampling times [s, true time] and quantised values, no noise, no latency.

    time: increasing, shape (n,). Samples fall at start + k period within [time[0], time[-1]];
    between the given times the value is interpolated. Raises ValueError for a channel of events.
    """
    if timing.period == 0.0:
        raise ValueError("a period of 0 sends every event; such a channel is not sampled")
    first = np.ceil((time[0] - start) / timing.period - 1e-9)
    last = np.floor((time[-1] - start) / timing.period + 1e-9)
    at = start + timing.period * np.arange(first, last + 1)
    interpolated = np.interp(at, time, values)
    return at, quantised(interpolated, timing.quantum)


def quantised(values: Floats, quantum: float) -> Floats:
    """Values rounded to multiples of a quantum in their unit, shape (n,); 0 leaves them."""
    return np.asarray(np.round(values / quantum) * quantum) if quantum > 0.0 else values


def mean_quantised(
    values: Floats, quantum: float, noise: float, phase: float = 0.0, least: float = 0.2
) -> Floats:
    """Mean of noisy values after rounding to phase + n quantum, shape (n,), in the unit of `values`.

    E[round(x)] = x + sum (-1)^k q / (pi k) exp(-2 (pi k s / q)^2) sin(2 pi k x / q): Widrow and
    Kollar, Quantization Noise (2008), chapter 4. least: share of a quantum that noise is taken as
    at least, since the values themselves are not known better.
    """
    if quantum <= 0.0:
        return values
    spread = max(noise / quantum, least)
    if spread > MOST_SPREAD:
        return values
    reading = values.copy()
    turn = 2.0 * np.pi * (values - phase) / quantum
    for k in range(1, HARMONICS):
        height = (-1) ** k * quantum / (np.pi * k) * np.exp(-2.0 * (np.pi * k * spread) ** 2)
        if abs(height) < 1e-4 * quantum:
            break
        reading += height * np.sin(k * turn)
    return reading


def latest(fresh: NDArray[np.bool_], last: float, values: Floats) -> Floats:
    """Newest fresh value at each sample, shape (n,); `last` before the first fresh one."""
    place = np.maximum.accumulate(np.where(fresh, np.arange(1, len(values) + 1), 0))
    return np.concatenate([[last], values])[place]
