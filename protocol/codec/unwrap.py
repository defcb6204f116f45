"""Counters and clocks on the wire wrap; these give their turns back."""

import numpy as np
import numpy.typing as npt

IntArray = npt.NDArray[np.int64]


def unwrap(values: npt.NDArray[np.integer], modulo: int) -> IntArray:
    """Running count behind a wrapping one that only goes up, by less than a turn at a time.

    values: (n,), 0..modulo - 1. Returns (n,), beginning with values[0].
    """
    counts = values.astype(np.int64)
    if not counts.size:
        return counts
    steps = np.diff(counts, prepend=counts[0]) % modulo
    return np.asarray(counts[0] + np.cumsum(steps), np.int64)


def unwrap_clock(stamps: npt.NDArray[np.integer], modulo: int, elapsed: IntArray) -> IntArray:
    """Running time behind a wrapping clock, across gaps of any number of turns.

    stamps: (n,), 0..modulo - 1. elapsed: (n,) time of arrival on any other clock, in the stamps'
    unit. Between two stamps the turn is taken that agrees best with their arrivals, so that delays
    that differ by less than half a turn do no harm, and a frame overtaken by a younger one stays
    in its place. Returns (n,), beginning with stamps[0].
    """
    times = stamps.astype(np.int64)
    if not times.size:
        return times
    steps = np.diff(times, prepend=times[0]) % modulo
    waited = np.diff(elapsed, prepend=elapsed[0])
    turns = (waited - steps + modulo // 2) // modulo
    return np.asarray(times[0] + np.cumsum(steps + turns * modulo), np.int64)
