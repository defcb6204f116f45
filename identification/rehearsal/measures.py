"""What a ride under slip control is judged by."""

import math
from dataclasses import dataclass

import numpy as np

from identification.design.loop import first_fall
from identification.rehearsal.ride import TICK, Ridden
from protocol.channel import FloatArray

BAND = 0.1  # of a step, in which the slip counts as settled


@dataclass(frozen=True)
class StepMeasures:
    """overshoot: share of the step; settling: s until the slip stays within 10 % of it. The worse
    one of steps up and steps down, each the mean of all alike: sensor noise is in `noise`, the
    deviation of a single step from their mean."""

    overshoot: float
    settling: float
    noise: float


def step_measures(target: FloatArray, slip: FloatArray, period: float = TICK) -> StepMeasures:
    """Measure steps of a target that follow each other evenly. target, slip: (n,); period: s."""
    at = np.flatnonzero(np.abs(np.diff(target)) > 1e-9) + 1
    lasts = int(np.min(np.diff([*at, target.size])))
    before, after = target[at - 1], target[at]
    share = (slip[at[:, None] + np.arange(lasts)] - before[:, None]) / (after - before)[:, None]
    means = [share[up].mean(axis=0) for up in (after > before, after < before) if up.any()]
    alike = [share[up] for up in (after > before, after < before) if up.any()]
    noise = np.sqrt(np.mean([np.mean((s - m) ** 2) for s, m in zip(alike, means, strict=True)]))
    return StepMeasures(
        max(float(m.max()) for m in means) - 1.0, max(_settled(m, period) for m in means),
        float(noise),
    )  # fmt: skip


def _settled(share: FloatArray, period: float) -> float:
    outside = np.flatnonzero(np.abs(share - 1.0) > BAND)
    last = int(outside[-1]) + 1 if outside.size else 0
    return last * period if last < share.size else math.inf


def tracking_bandwidth(
    target: FloatArray, slip: FloatArray, start: float = 0.7, stop: float = 13.0
) -> float:
    """Frequency at which the slip follows a swept target by 3 dB less, Hz; the last one that it
    follows so well where it never falls so far.

    The ratio of cross and auto spectrum over windows of a second, half of them overlapping.
    target, slip: every `TICK`, (n,).
    """
    length = round(1.0 / TICK)
    x, y = (v - v.mean() for v in (target, slip))
    window = np.hanning(length)
    starts = range(0, x.size - length + 1, length // 2)
    X, Y = (np.array([np.fft.rfft(window * v[s : s + length]) for s in starts]) for v in (x, y))
    f = np.fft.rfftfreq(length, TICK)
    power = np.sum(np.abs(X) ** 2, axis=0)
    gain = np.abs(np.sum(np.conj(X) * Y, axis=0)) / np.maximum(power, 1e-300)
    driven = (f >= start) & (f <= stop) & (power > 1e-3 * power.max())
    reach = first_fall(f[driven], gain[driven])
    return reach if math.isfinite(reach) else float(f[driven][-1])


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
