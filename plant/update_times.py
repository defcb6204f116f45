"""Update times: when a device updated the value that its frames carry, as a recording shows it.

A frame that repeats the one before it, while what is measured moves, was not renewed. Such frames
come by chance (stale frames) or in a rhythm (a device that sends more often than it measures). A
frame with another value was certainly updated, so that the rhythm shows in these alone,
also where nothing moves for a while: all of them are in phase with one frequency.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.plant.signals import Floats

FEWEST = 0.01
"""Share of repeated frames that chance and noise bring about."""
FEW = 20
"""Updates from which a rhythm can be identified."""
NEXT = 0.02
"""Share of renewals in neighbouring frames that a hold of two frames and more may have, or two."""
KEPT = 0.7
"""Share of a perfect rhythm's coherence from which it is one."""
CHANCE = 15.0
"""Renewals times squared coherence: by chance more than that comes once in exp(15) times."""


@dataclass(frozen=True)
class Renewals:
    """late: sent value less what there is, where a frame was not renewed, (k,).

    share: of the frames that were not renewed while the value moved.
    """

    late: Floats
    share: float


def renewals(value: Floats, again: Floats, step: float) -> Renewals | None:
    """Which frames were not renewed; None where so few are that it may be chance.

    value: what there is at the frames, (k,); again: 1 where a frame repeats the one before it;
    step: less than this is no movement. What moves slowly moves from frame to frame by less, and
    counts by how far it has come since the last renewal.
    """
    repeated = again > 0.5
    last = np.maximum.accumulate(np.where(repeated, 0, np.arange(value.size)))
    moving = np.abs(value - value[np.concatenate(([0], last[:-1]))]) > step
    share = float(np.mean(repeated[moving])) if moving.any() else 0.0
    if share < FEWEST:
        return None
    late = value[last] - value
    return Renewals(np.where(np.abs(late) > step, late, 0.0), share)


def rhythm(again: Floats) -> float:
    """Frames from one renewal to the next, 0 where they come by chance or always.

    again: 1 where a frame repeats the one before it, (k,).
    """
    fresh = again <= 0.5
    at = np.flatnonzero(fresh)
    if at.size < FEW or at.size > again.size / 1.1:
        return 0.0
    apart = np.diff(at)
    if not _less_than_two(apart):
        shortest = float(np.quantile(apart, 0.05))
        return _strongest(fresh, 1.0 / (shortest + 1.0), 1.02 / shortest)
    # Less than two frames are seen as the line that is left of them at one less their frequency.
    return _strongest(fresh, 0.1, 0.5, mirrored=True)


def _less_than_two(apart: np.ndarray) -> bool:
    """Whether a rhythm renews before two frames are over, from frames between renewals.

    A little less than two leaves a few neighbours and a little more a few gaps of three; both are
    the same line.
    """
    one, three = (int(np.sum(apart == n)) for n in (1, 3))
    about_two = np.median(apart) == 2 and one > three
    return one > 2 and (bool(about_two) or one > NEXT * apart.size)


def _strongest(fresh: np.ndarray, low: float, high: float, mirrored: bool = False) -> float:
    """The hold of the strongest line between two frequencies per frame, 0 where it is weak.

    In a rhythm a renewal is late by up to a frame, which leaves sinc(1 / hold) of its line.
    """
    frequency, lines = _lines(fresh)
    inside = (frequency >= low) & (frequency <= high)
    best = int(np.argmax(lines[inside]))
    found, line = float(frequency[inside][best]), float(lines[inside][best])
    hold = 1.0 / (1.0 - found if mirrored else found)
    strong = np.sum(fresh) * line**2 > CHANCE
    return hold if strong and line > KEPT * float(np.sinc(1.0 / hold)) else 0.0


def _lines(fresh: np.ndarray) -> tuple[Floats, Floats]:
    """Coherence of the renewals with every frequency per frame, 1 where all are in phase."""
    length = 8 * fresh.size
    power = np.abs(np.fft.rfft(fresh.astype(float), length)) / np.sum(fresh)
    return np.asarray(np.fft.rfftfreq(length), np.float64), np.asarray(power)
