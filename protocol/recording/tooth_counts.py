"""Running count of teeth: the wrapping counts of tooth frames, unwrapped."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec.e2e import PERIOD
from slipbench.protocol.codec.unwrap import unwrap_clock
from slipbench.protocol.recording.tooth_frames import MICROSECOND, Anchors, IntArray, ToothFrames


def absolute_counts(frames: ToothFrames, anchors: Anchors) -> tuple[IntArray, Anchors]:
    """Running count of each frame's last tooth, (n,), and the anchors on the same count.

    A frame that continues the one before in counter and in count has lost nothing. Otherwise the
    teeth lost are known up to whole turns of the count; the speed on both sides determines how
    many. Where the status has arrived, its wider count is used, carried from the nearest one.
    """
    count = frames.count[0] + np.concatenate([[0], np.cumsum(_steps(frames))])
    if anchors.count.size == 0:
        return count, anchors
    passed = _at(anchors.arrival, frames, count)
    if anchors.modulo is not None:
        unwrapped = unwrap_clock(anchors.count, anchors.modulo, np.rint(passed).astype(np.int64))
        anchors = replace(anchors, count=unwrapped, modulo=None)
    near = _nearest(anchors.arrival, frames.arrival)
    expected = anchors.count[near] + count - passed[near]
    turns = np.rint((expected - frames.count) / frames.modulo).astype(np.int64)
    return frames.count + turns * frames.modulo, anchors


def _steps(frames: ToothFrames) -> IntArray:
    """Number of teeth from each frame's last tooth to that of the next frame."""
    reported = np.count_nonzero(frames.intervals, axis=1)[1:]
    missing = (np.diff(frames.count) - reported) % frames.modulo
    follows = (missing == 0) & (np.diff(frames.counter) % PERIOD == 1)
    waited = np.diff(frames.arrival) / MICROSECOND - frames.intervals[1:].sum(axis=1)
    rate = _rate(frames)
    expected = np.maximum(waited, 0.0) * (rate[1:] + rate[:-1]) / 2
    turns = np.maximum(np.rint((expected - missing) / frames.modulo), 0.0)
    turns[follows] = 0.0
    return np.asarray(reported + missing + frames.modulo * turns, np.int64)


def _rate(frames: ToothFrames) -> npt.NDArray[np.float64]:
    """Teeth per us in each frame; 0 where the wheel stands still."""
    reported = np.count_nonzero(frames.intervals, axis=1)
    total = frames.intervals.sum(axis=1)
    return np.asarray(np.divide(reported, total, out=np.zeros(reported.size), where=total > 0))


def _at(arrival: IntArray, frames: ToothFrames, count: IntArray) -> npt.NDArray[np.float64]:
    """Count at the times `arrival`: interpolated between frames, extrapolated at the last speed."""
    rate = _rate(frames) / MICROSECOND
    before = np.minimum(arrival - frames.arrival[0], 0) * rate[0]
    after = np.maximum(arrival - frames.arrival[-1], 0) * rate[-1]
    return np.asarray(np.interp(arrival, frames.arrival, count) + before + after, np.float64)


def _nearest(times: IntArray, to: IntArray) -> npt.NDArray[np.intp]:
    """Index of the time nearest to each of `to`; both ascending."""
    after = np.searchsorted(times, to).clip(max=times.size - 1)
    before = (after - 1).clip(min=0)
    return np.where(times[after] - to < to - times[before], after, before)
