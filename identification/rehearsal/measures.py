"""What a ride under slip control is judged by."""

import math
from dataclasses import dataclass

import numpy as np

from identification.rehearsal.ride import TICK, Ridden
from protocol.channel import FloatArray

BAND = 0.1  # of a step, in which the slip counts as settled


@dataclass(frozen=True)
class StepMeasures:
    """overshoot: share of the step; settling: s until the slip stays within 10 % of it."""

    overshoot: float
    settling: float


def step_measures(ridden: Ridden) -> StepMeasures:
    """Measure the worst overshoot and the median settling of all steps of the target."""
    at = np.flatnonzero(np.abs(np.diff(ridden.target)) > 1e-9) + 1
    ends = [*at[1:], ridden.target.size]
    over, settled = [], []
    for start, end in zip(at, ends, strict=True):
        before, after = ridden.target[start - 1], ridden.target[start]
        share = (ridden.slip[start:end] - before) / (after - before)
        over.append(float(share.max() - 1.0))
        outside = np.flatnonzero(np.abs(share - 1.0) > BAND)
        last = int(outside[-1]) + 1 if outside.size else 0
        settled.append(last * TICK if last < share.size else math.inf)
    return StepMeasures(max(over), float(np.median(settled)))


def tracking_bandwidth(ridden: Ridden, start: float = 0.7, stop: float = 12.0) -> float:
    """Frequency at which the slip follows a swept target by 3 dB less, Hz; the last one that it
    follows so well where it never falls so far.

    The ratio of cross and auto spectrum over windows of a second, half of them overlapping.
    """
    length = round(1.0 / TICK)
    x, y = (v - v.mean() for v in (ridden.target, ridden.slip))
    window = np.hanning(length)
    starts = range(0, x.size - length + 1, length // 2)
    X, Y = (np.array([np.fft.rfft(window * v[s : s + length]) for s in starts]) for v in (x, y))
    f = np.fft.rfftfreq(length, TICK)
    power = np.sum(np.abs(X) ** 2, axis=0)
    gain = np.abs(np.sum(np.conj(X) * Y, axis=0)) / np.maximum(power, 1e-300)
    driven = (f >= start) & (f <= stop) & (power > 1e-3 * power.max())
    f, gain = f[driven], gain[driven]
    low = np.flatnonzero(gain < math.sqrt(0.5) * gain[:2].mean())
    return float(f[low[0]]) if low.size else float(f[-1])


def mean_retard(ridden: Ridden) -> float:
    """Mean of the spark's retard, rad: what it costs in efficiency."""
    return float(np.mean(np.maximum(-ridden.spark, 0.0)))


def error(ridden: Ridden, after: float = 0.0) -> float:
    """Root mean square distance of slip from target, from `after` s on."""
    part = ridden.time >= after
    return float(np.sqrt(np.mean((ridden.slip[part] - ridden.target[part]) ** 2)))


def time_lost(ridden: Ridden, best: Ridden) -> float:
    """Time behind the best constant slip at the end, s: distance behind over speed."""
    behind = float(best.distance[-1] - ridden.distance[-1])
    return behind / max(float(best.speed[-1]), 1.0)


def calm(slip: FloatArray) -> bool:
    """Tell whether a loop is stable: it swings no more at its end than in its middle."""
    half = slip.size // 2
    quarter = slip.size // 4
    early, late = np.ptp(slip[half : half + quarter]), np.ptp(slip[-quarter:])
    return bool(np.isfinite(late) and late < max(1.5 * early, 0.002))
