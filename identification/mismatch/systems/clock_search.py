"""Align a channel on an unrelated clock with the simulation by their largest correlation."""

import numpy as np
from scipy import signal

from slipbench.plant.signals import Floats

LEAST = 0.5
"""Least share of the simulated time series that the recorded one must cover."""


def best_shift(step: float, simulated: Floats, time: Floats, value: Floats) -> tuple[float, float]:
    """Return the time on a channel's clock at the begin of row 0, s, and the correlation there.

    simulated: (rows,), every `step` s, row k at (k + 1) step; time, value: recorded samples, (n,).
    The resolution is one row; an effect of the clock (clock_offset.py) estimates the remainder.
    """
    grid = np.arange(time[0], time[-1], step)
    recorded = np.interp(grid, time, value)
    valid = np.ones_like(recorded)
    x, y = recorded - recorded.mean(), simulated - simulated.mean()
    ones = np.ones_like(y)
    # Sums over every overlap, for all shifts at once; index k: recorded row k - (rows - 1) first.
    n = np.maximum(signal.fftconvolve(valid, ones), 1.0)
    sx, sxx = (signal.fftconvolve(v, ones) for v in (x, x * x))
    sy, syy = (signal.fftconvolve(valid, v[::-1]) for v in (y, y * y))
    sxy = signal.fftconvolve(x, y[::-1])
    variances = np.maximum(sxx - sx * sx / n, 1e-12) * np.maximum(syy - sy * sy / n, 1e-12)
    correlations = np.where(n >= LEAST * y.size, (sxy - sx * sy / n) / np.sqrt(variances), 0.0)
    best = int(np.argmax(np.abs(correlations)))  # a sensor may have the opposite sign
    first = best - (y.size - 1)
    return float(grid[0] + first * step - step), float(correlations[best])
