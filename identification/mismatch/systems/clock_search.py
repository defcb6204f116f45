"""Two clocks with nothing in common are laid together where what they tell is most alike."""

import numpy as np
from scipy import signal

from slipbench.plant.signals import Floats

LEAST = 0.5
"""Share of the simulated course that the recorded one must cover."""


def best_shift(step: float, simulated: Floats, time: Floats, value: Floats) -> tuple[float, float]:
    """Return what a recorded channel's clock showed when row 0 began, and the correlation there.

    simulated: (rows,), every `step` s, row k at (k + 1) step; time, value: recorded samples. The
    shift is found to a row; what is left of it is for an effect of the clock to tell.
    """
    grid = np.arange(time[0], time[-1], step)
    recorded = np.interp(grid, time, value)
    known = np.ones_like(recorded)
    x, y = recorded - recorded.mean(), simulated - simulated.mean()
    ones = np.ones_like(y)
    # Sums over every overlap, for all shifts at once; index k: recorded row k - (rows - 1) first.
    n = np.maximum(signal.fftconvolve(known, ones), 1.0)
    sx, sxx = (signal.fftconvolve(v, ones) for v in (x, x * x))
    sy, syy = (signal.fftconvolve(known, v[::-1]) for v in (y, y * y))
    sxy = signal.fftconvolve(x, y[::-1])
    spread = np.maximum(sxx - sx * sx / n, 1e-12) * np.maximum(syy - sy * sy / n, 1e-12)
    alike = np.where(n >= LEAST * y.size, (sxy - sx * sy / n) / np.sqrt(spread), 0.0)
    best = int(np.argmax(np.abs(alike)))  # a sensor may tell the opposite
    first = best - (y.size - 1)
    return float(grid[0] + first * step - step), float(alike[best])
