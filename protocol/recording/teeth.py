"""Tooth times from tooth frames: a lost frame is a step of the count, never a wrong time.

A frame reports how many teeth have passed (a wrapping count) and the intervals that end with its last
tooth. Frames that follow each other without a gap make a run; inside a run every time is exact
relative to every other. The encoder's status gives the absolute time of one tooth now and then and
so anchors the run in which that tooth lies. A run between two losses that holds no anchor is
placed by its arrival, with the transit time of anchored neighbours, and is marked as such.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt

from slipbench.protocol.logs.decode import Frames
from slipbench.protocol.recording.tooth_counts import absolute_counts
from slipbench.protocol.recording.tooth_frames import (
    MICROSECOND,
    OWN_NAMES,
    Anchors,
    IntArray,
    ToothFrames,
    tooth_anchors,
    tooth_frames,
)


@dataclass(frozen=True)
class Teeth:
    """m teeth, in order.

    time_us     (m,) encoder's own clock; on the arrivals' clock where there is no anchor at all
    count       (m,) running count; a step of 1 is an exact interval, a greater one states how many
                teeth are unknown
    arrival_ns  (m,) arrival of the frame that reported the tooth, on the log's clock
    anchored    (m,) False where the time follows from the arrival: exact only relative to the teeth
                to which steps of 1 join it
    """

    time_us: IntArray
    count: IntArray
    arrival_ns: IntArray
    anchored: npt.NDArray[np.bool_]

    @property
    def time(self) -> npt.NDArray[np.float64]:
        """Time of each tooth, s."""
        return np.asarray(self.time_us * 1e-6, np.float64)


def teeth(
    frames: Frames,
    anchors: Frames,
    time_ns: IntArray,
    names: Mapping[str, str] = OWN_NAMES,
    anchor_names: Mapping[str, str] = OWN_NAMES,
) -> Teeth:
    """Times and counts of all teeth that a log reports. time_ns: of the log's n frames, ns, (n,).

    names, anchor_names: of signals that do not have the names of their fields.

    Frames with a wrong CRC and repeated frames are left out. Frames of several encoders or buses
    must not be mixed.
    """
    good = frames.select(frames.protected)
    return placed_teeth(
        tooth_frames(good, time_ns, names), tooth_anchors(anchors, time_ns, anchor_names)
    )


def placed_teeth(frames: ToothFrames, anchors: Anchors) -> Teeth:
    """Time and count of every tooth, from frames and anchors."""
    frames = frames.select(~_repeated(frames))
    if not frames.count.size:
        nothing = np.zeros(0, np.int64)
        return Teeth(nothing, nothing, nothing, np.zeros(0, np.bool_))
    last, anchors = absolute_counts(frames, anchors)
    reported = np.count_nonzero(frames.intervals, axis=1)
    starts = np.concatenate([[True], last[1:] - reported[1:] != last[:-1]])
    teeth_reported = (
        reported + starts
    )  # the first frame of a run also reports the tooth it counts from
    frame = np.repeat(np.arange(last.size), teeth_reported)
    index = np.arange(frame.size) - np.repeat(
        np.cumsum(teeth_reported) - teeth_reported, teeth_reported
    )
    count = last[frame] - teeth_reported[frame] + 1 + index
    first = starts[frame] & (index == 0)
    elapsed = np.zeros(frame.size, np.int64)
    elapsed[~first] = frames.intervals[frames.intervals > 0]
    run = np.cumsum(first) - 1
    elapsed = np.cumsum(elapsed)
    elapsed -= elapsed[first][run]
    arrival = frames.arrival[frame]
    time, anchored = _times(count, elapsed, run, arrival, anchors)
    kept = _kept(count, first, anchored)
    return Teeth(time[kept], count[kept], arrival[kept], anchored[kept])


def _kept(
    count: IntArray, first: npt.NDArray[np.bool_], anchored: npt.NDArray[np.bool_]
) -> npt.NDArray[np.bool_]:
    """Mask without the first tooth of a run where only the interval before it is lost.

    The run before ended one tooth earlier. Unless both are anchored the interval between them is
    not known, and a count that steps by one would state that it is.
    """
    next_to = np.diff(count, prepend=count[0] - 2) == 1
    both = anchored & np.concatenate([[False], anchored[:-1]])
    return np.asarray(~(first & next_to) | both, np.bool_)


def _repeated(frames: ToothFrames) -> npt.NDArray[np.bool_]:
    """Whether each frame repeats the one before: same counter, same content."""
    same = (np.diff(frames.counter) == 0) & (np.diff(frames.count) == 0)
    same &= (np.diff(frames.intervals, axis=0) == 0).all(axis=1)
    return np.concatenate([np.zeros(min(1, frames.count.size), np.bool_), same])


def _times(
    count: IntArray, elapsed: IntArray, run: IntArray, arrival: IntArray, anchors: Anchors
) -> tuple[IntArray, npt.NDArray[np.bool_]]:
    """Time of each tooth, us, and whether an anchor gives it."""
    tooth = np.minimum(np.searchsorted(count, anchors.count), count.size - 1)
    hit = np.flatnonzero(count[tooth] == anchors.count)
    start = np.zeros(run[-1] + 1, np.int64)
    anchored = np.zeros(run[-1] + 1, np.bool_)
    tooth, times = tooth[hit], anchors.time[hit]
    start[run[tooth]] = times - elapsed[tooth]
    anchored[run[tooth]] = True
    time, known = start[run] + elapsed, anchored[run]
    if not anchored.all():
        _place_by_arrival(time, known, elapsed, run, arrival)
    return time, known


def _place_by_arrival(
    time: IntArray,
    known: npt.NDArray[np.bool_],
    elapsed: IntArray,
    run: IntArray,
    arrival: IntArray,
) -> None:
    """Place runs without an anchor by the arrival of their first frame, between their neighbours."""
    came = arrival // MICROSECOND
    transit = came - time
    if known.any():
        transit = np.interp(came, came[known], transit[known]).astype(np.int64)
    else:
        transit = np.zeros_like(came)
    edges = np.flatnonzero(np.diff(run, prepend=-1, append=run[-1] + 1))
    for first, end in pairwise(edges):
        if known[first]:
            continue
        row = np.searchsorted(came[first:end], came[first], side="right") - 1 + first
        start = came[first] - transit[first] - elapsed[row]
        if end < time.size and known[end]:
            start = min(start, time[end] - 1 - elapsed[end - 1])
        if first:
            start = max(start, time[first - 1] + 1)
        time[first:end] = start + elapsed[first:end]
