"""Evidence of tooth-pitch errors in tooth times, with slow motion removed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import signal

from slipbench.controllers.pitch_learner import STANDING_AFTER, TIMER, quick
from slipbench.protocol.recording.channel import FloatArray

IntArray = npt.NDArray[np.intp]
MEMORY = 0.3  # s for which an input is remembered
TAPS = 40
STILL = 1e-9  # of an input's range; what moves less in the intervals used says nothing there
MOST = 60_000  # intervals that are used; a longer recording is thinned to turns spread over it


@dataclass(frozen=True)
class Answers:
    """An input to which the wheel may respond. time: s, (m,), increasing; value: (m,)."""

    time: FloatArray
    value: FloatArray


@dataclass(frozen=True)
class Evidence:
    """Intervals with an unbroken turn and more on both sides.

    value    (n,) log speed without its slow part; a pattern of gaps is kept in it
    tooth    (n,) with which tooth the interval begins, 0..N-1
    delayed  (n, q) the inputs, treated in the same way, at q delays
    timer    (n,) relative error of an interval by the timer's steps
    window   weights that average over four turns
    batches  that may be made, each of two turns or more
    """

    value: FloatArray
    tooth: IntArray
    delayed: FloatArray
    timer: FloatArray
    window: FloatArray
    batches: int


def evidence(
    time: FloatArray, count: FloatArray, teeth: int, inputs: Sequence[Answers] = ()
) -> Evidence:
    """Fast part of the log speed at each tooth, without samples near lost teeth or a standstill.

    time: s, shape (n,); count: running count of teeth, shape (n,); teeth: per revolution.
    """
    interval, step = np.diff(time), np.diff(count)
    good = (step == 1) & (interval > 0) & (interval < STANDING_AFTER)
    speed = -np.log(np.where(good, interval, 1.0))
    middle = time[:-1] + interval / 2
    lags = _lags(interval[good])
    kernel = quick(teeth)
    whole = _whole(good, kernel.size)
    whole[: lags.max() if inputs else 0] = False
    kept = _spread(np.flatnonzero(whole), teeth)
    value = filtered(np.where(good, speed, 0.0), kernel)[kept]
    tooth = np.mod(np.round(count[:-1][kept]).astype(np.int64), teeth)
    columns = [_lagged(given, middle, kernel, kept, lags) for given in inputs]
    delayed = np.concatenate([np.empty((kept.size, 0)), *columns], axis=1)
    timer = TIMER / np.sqrt(6) / interval[kept]
    window = np.ones(4 * teeth + 1) / (4 * teeth + 1)
    return Evidence(value, tooth, delayed, timer, window, max(kept.size // (2 * teeth), 2))


def filtered(value: FloatArray, kernel: FloatArray) -> FloatArray:
    """Centred convolution without the mean, shape (n,); zero where the kernel does not fit."""
    if value.size < kernel.size:
        return np.zeros_like(value)
    return np.asarray(signal.fftconvolve(value - value.mean(), kernel, mode="same"))


def _whole(good: npt.NDArray[np.bool_], size: int) -> npt.NDArray[np.bool_]:
    """Whether every interval under the kernel is known, (n,)."""
    if good.size < size:
        return np.zeros(good.size, np.bool_)
    lost = np.concatenate(([0], np.cumsum(~good)))
    whole = np.zeros(good.size, np.bool_)
    whole[size // 2 : good.size - size // 2] = lost[size:] == lost[:-size]
    return whole


def _lags(interval: FloatArray) -> IntArray:
    """Delays at which an input is looked at, in tooth intervals."""
    if not interval.size:
        return np.zeros(1, np.intp)
    far = MEMORY / float(np.median(interval))
    return np.unique(np.round(np.linspace(0, far, min(TAPS, int(far) + 2))).astype(np.intp))


def _lagged(
    given: Answers, middle: FloatArray, kernel: FloatArray, kept: IntArray, lags: IntArray
) -> FloatArray:
    """Take an input at the intervals' middles, without its slow part, at every delay."""
    known = np.isfinite(given.value)
    if np.count_nonzero(known) < 2 or np.ptp(given.value[known]) == 0:
        return np.empty((kept.size, 0))
    held = np.interp(middle, given.time[known], given.value[known])
    late = filtered(held, kernel)[kept[:, None] - lags[None, :]]
    moves = late.std(axis=0) > STILL * np.ptp(given.value[known]) if kept.size else slice(0)
    return np.asarray(late[:, moves])


def _spread(kept: IntArray, teeth: int) -> IntArray:
    """Thin a long recording to whole segments of 16 turns, evenly spread over it."""
    if kept.size <= MOST:
        return kept
    length = 16 * teeth
    starts = np.linspace(0, kept.size - length, MOST // length).astype(np.intp)
    return np.asarray(kept[(starts[:, None] + np.arange(length)).ravel()])
