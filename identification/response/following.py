"""Tracking of the slip target in a trial under slip control.

In a closed loop no response of the motorcycle can be identified, but the loop itself can be judged:
by its steps, by how far up it follows a sweep, and by the residual between slip and target.
"""

import math
from dataclasses import dataclass

import numpy as np

from slipbench.identification.signals.dataset import Dataset
from slipbench.identification.signals.filters import bridged, low_pass
from slipbench.identification.signals.motion import Motion, NoMotion
from slipbench.identification.signals.trial_window import NoExcitation, TrialWindow
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.trial_file import Square, TrialFile
from slipbench.protocol.units import parse_quantity
from slipbench.protocol.waveforms import waveform

BAND = 0.1  # of a step, in which the slip counts as settled
BEFORE = 0.5  # s before the button, whose mean slip a target without a number is
SHORTEST = 3.0  # s that a bandwidth needs
QUICK = 25.0  # Hz: what slip does beyond it in a step is the sensors' noise
HALF = math.sqrt(0.5)


@dataclass(frozen=True, eq=False)
class StepMeasures:
    """overshoot: share of the step; settling: s until the slip stays within 10 % of it. The worse
    one of steps up and steps down, each the mean of all of its direction; noise: deviation of a
    single step from their mean."""

    overshoot: float
    settling: float
    noise: float


@dataclass(frozen=True, eq=False)
class Following:
    """target: requested slip, slip: as measured, both over the excitation, (n,); error: root mean
    square of their difference; steps: None where the target did not step; bandwidth: Hz to which
    the slip followed a sweep (-3 dB), NaN where the target was no sweep."""

    target: FloatArray
    slip: FloatArray
    error: float
    steps: StepMeasures | None
    bandwidth: float


def following(
    base: Dataset,
    moved: Motion | NoMotion,
    window: TrialWindow | NoExcitation,
    trial: TrialFile | None,
) -> Following | None:
    """Judge the slip against its target; None where nothing controlled it, or no slip is known."""
    if trial is None or trial.controller is None:
        return None
    if isinstance(moved, NoMotion) or isinstance(window, NoExcitation):
        return None
    part = window.exciting
    slip = bridged(moved.slip.ratio[part])
    before = moved.slip.ratio[max(part.start - round(BEFORE * base.rate), 0) : part.start]
    level = trial.controller.target
    if level is None:
        level = float(np.nanmean(before)) if np.isfinite(before).any() else math.nan
    if not np.isfinite(slip).all() or not math.isfinite(level):
        return None
    time = base.time[part] - base.time[part.start]
    spec = trial.excitation
    target = level + parse_quantity(spec.amplitude, "") * waveform(spec)(time)
    stepped = isinstance(spec, Square)
    swept = not stepped and time[-1] >= SHORTEST
    return Following(
        target,
        slip,
        float(np.sqrt(np.mean((slip - target) ** 2))),
        step_measures(target, low_pass(slip, base.rate, QUICK), 1 / base.rate) if stepped else None,
        tracking_bandwidth(target, slip, base.rate) if swept else math.nan,
    )


def step_measures(target: FloatArray, slip: FloatArray, period: float) -> StepMeasures | None:
    """Measure steps of a target that follow each other evenly; None where it never steps.

    target, slip: (n,); period: s.
    """
    at = np.flatnonzero(np.abs(np.diff(target)) > 1e-9) + 1
    if not at.size:
        return None
    ends = np.diff([*at, target.size])
    lasts = int(np.median(ends))
    at = at[ends >= 0.9 * lasts]  # the last one may have been cut short
    lasts = int(ends[ends >= 0.9 * lasts].min())
    before, after = target[at - 1], target[at]
    share = (slip[at[:, None] + np.arange(lasts)] - before[:, None]) / (after - before)[:, None]
    by_direction = [share[up] for up in (after > before, after < before) if up.any()]
    means = [s.mean(axis=0) for s in by_direction]
    noise = np.sqrt(
        np.mean([np.mean((s - m) ** 2) for s, m in zip(by_direction, means, strict=True)])
    )
    return StepMeasures(
        max(float(m.max()) for m in means) - 1.0,
        max(_settled(m, period) for m in means),
        float(noise),
    )


def _settled(share: FloatArray, period: float) -> float:
    outside = np.flatnonzero(np.abs(share - 1.0) > BAND)
    last = int(outside[-1]) + 1 if outside.size else 0
    return last * period if last < share.size else math.inf


def tracking_bandwidth(
    target: FloatArray, slip: FloatArray, rate: float, start: float = 0.7, stop: float = 13.0
) -> float:
    """Frequency at which the slip follows a swept target by 3 dB less, Hz; the last one that it
    follows so well where it never falls so far.

    The ratio of cross and auto spectrum over windows of a second, half of them overlapping.
    target, slip: (n,); rate: Hz.
    """
    length = round(rate)
    x, y = (v - v.mean() for v in (target, slip))
    window = np.hanning(length)
    starts = range(0, x.size - length + 1, length // 2)
    X, Y = (np.array([np.fft.rfft(window * v[s : s + length]) for s in starts]) for v in (x, y))
    f = np.fft.rfftfreq(length, 1 / rate)
    power = np.sum(np.abs(X) ** 2, axis=0)
    gain = np.abs(np.sum(np.conj(X) * Y, axis=0)) / np.maximum(power, 1e-300)
    driven = (f >= start) & (f <= stop) & (power > 1e-3 * power.max())
    reach = first_fall(f[driven], gain[driven])
    return reach if math.isfinite(reach) else float(f[driven][-1])


def first_fall(frequency: FloatArray, size: FloatArray) -> float:
    """Frequency at which a gain first falls through -3 dB, Hz; NaN where it does not."""
    below = np.flatnonzero(size < HALF)
    if not below.size or below[0] == 0:
        return math.nan
    return between(frequency, size, int(below[0]) - 1)


def between(frequency: FloatArray, size: FloatArray, k: int) -> float:
    """Frequency at which a gain crosses -3 dB between its values k and k + 1, Hz."""
    share = (HALF - size[k]) / (size[k + 1] - size[k])
    return float(frequency[k] + share * (frequency[k + 1] - frequency[k]))
