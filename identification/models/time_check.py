"""A model found in frequency, checked in time: short segments of the sweep, figure 7 of the paper.

The model is simulated with the measured input; its output and the measured one are compared where
the sweep passed some frequency, over a few periods, both without their mean and slope there.

    segments = time_check(model, u, y, rate, frequency, at=(3.5, 5.0, 9.0))
    [(s.frequency, s.fit) for s in segments]      # Hz, %
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.models.rational_model import RationalModel
from slipbench.protocol.recording.channel import FloatArray

PERIODS = 5.0
SHARES = (0.35, 0.5, 0.9)  # of the servo's bandwidth, as in the paper


@dataclass(frozen=True)
class Stretch:
    """time: (n,) s from the record's start. measured, simulated: (n,), mean and slope removed.

    frequency: Hz, that the sweep passed. fit: %, 100 (1 - |y - model| / |y|).
    """

    frequency: float
    time: FloatArray
    measured: FloatArray
    simulated: FloatArray
    fit: float


@dataclass(frozen=True)
class NoStretch:
    """Why there is no check at a frequency."""

    frequency: float
    reason: str


def time_check(
    model: RationalModel,
    u: FloatArray,
    y: FloatArray,
    rate: float,
    frequency: FloatArray,
    at: tuple[float, ...],
    periods: float = PERIODS,
) -> tuple[Stretch | NoStretch, ...]:
    """Compare the model's response to u with y where the sweep passed each frequency of `at` (Hz).

    u, y: (n,), at `rate` Hz, without unknown samples, from rest. frequency: (n,) Hz, the sweep's at
    every sample, NaN where nothing was excited.
    """
    response = model.simulate(u, rate)
    return tuple(_stretch(response, y, rate, frequency, f, periods) for f in at)


def fit_percent(measured: FloatArray, simulated: FloatArray) -> float:
    """100 (1 - |measured - simulated| / |measured - mean|), %: 100 where they are the same."""
    spread = float(np.linalg.norm(measured - measured.mean()))
    return 100 * (1 - float(np.linalg.norm(measured - simulated)) / max(spread, 1e-300))


def _stretch(
    response: FloatArray,
    y: FloatArray,
    rate: float,
    frequency: FloatArray,
    f: float,
    periods: float,
) -> Stretch | NoStretch:
    away = np.where(np.isfinite(frequency), np.abs(frequency - f), np.inf)
    middle = int(np.argmin(away))
    if away[middle] > 0.05 * f:
        return NoStretch(f, f"the sweep did not pass {f:g} Hz")
    half = round(periods / f * rate / 2)
    part = slice(middle - half, middle + half)
    if part.start < 0 or part.stop > y.size:
        return NoStretch(f, f"the record ends within {periods / 2:g} periods of {f:g} Hz")
    time = np.arange(part.start, part.stop) / rate
    measured, simulated = (_level(x[part]) for x in (y, response))
    return Stretch(f, time, measured, simulated, fit_percent(measured, simulated))


def _level(x: FloatArray) -> FloatArray:
    t = np.linspace(-1.0, 1.0, x.size)
    return np.asarray(x - np.polyval(np.polyfit(t, x, 1), t))
