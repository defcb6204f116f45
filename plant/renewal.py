"""What a recording tells of when a device renewed the value that its frames tell.

A frame that repeats the one before it, while what is measured moves, was not renewed. Such frames
come by chance (stale frames) or in a rhythm (a device that sends more often than it measures): in a
rhythm the j-th renewal stays within a frame of a straight line over j, by chance it wanders off.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from plant.signals import Floats

FEWEST = 0.01
"""Share of repeated frames that chance and noise bring about."""
FEW = 20
"""Renewals in a row from which a rhythm can be told."""
STRAIGHT = 0.5
"""Frames, root mean square, by which renewals in a rhythm stay off a straight line at most."""


@dataclass(frozen=True)
class Renewals:
    """late: what is told less what there is, where a frame was not renewed, (k,).

    share: of the frames that were not renewed while the value moved. rhythm: frames from one
    renewal to the next, 0 where they come by chance.
    """

    late: Floats
    share: float
    rhythm: float


def renewals(value: Floats, again: Floats, step: float) -> Renewals | None:
    """Tell which frames were not renewed; None where so few are that it may be chance.

    value: what there is at the frames, (k,); again: 1 where a frame repeats the one before it;
    step: less than this is no movement.
    """
    repeated = again > 0.5
    moving = np.abs(np.diff(value, prepend=value[0])) > step
    share = float(np.mean(repeated[moving])) if moving.any() else 0.0
    if share < FEWEST:
        return None
    last = np.maximum.accumulate(np.where(repeated, 0, np.arange(value.size)))
    late = value[last] - value
    return Renewals(np.where(np.abs(late) > step, late, 0.0), share, _rhythm(value, repeated, step))


def _rhythm(value: Floats, repeated: np.ndarray, step: float) -> float:
    """Return frames from one renewal to the next, 0 where renewals wander off a straight line."""
    at = np.flatnonzero(~repeated)
    moved = np.abs(np.diff(value[at])) > step * np.diff(at)
    ends = np.flatnonzero(~np.concatenate(([False], moved, [False])))
    off, slopes, weights = 0.0, 0.0, 0
    for first, last in pairwise(ends):
        part = at[first:last]
        if part.size >= FEW:
            slope, begin = np.polyfit(np.arange(part.size), part, 1)
            off += float(np.sum((part - begin - slope * np.arange(part.size)) ** 2))
            slopes += slope * part.size
            weights += part.size
    return slopes / weights if weights and off < STRAIGHT**2 * weights else 0.0
