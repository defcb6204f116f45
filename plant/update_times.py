"""Update times: when a device updated the value that its frames carry, as a recording shows it.

A frame that repeats the one before it, while the measured value moves, was not updated. Such frames
occur at random (stale frames) or periodically (a device that sends more often than it measures). A
frame with another value was certainly updated, so the period is identified from these alone.

Random updates are as frequent soon after an update as later (their hazard is constant: Cox, "Renewal
theory", 1962, section 1.2); periodic ones are rare at first, also where the period has jitter and
where the value rests for a while. A period below two frames has no such gap: all of its updates are
in phase with one frequency.
"""

from dataclasses import dataclass

import numpy as np
from scipy import special

from slipbench.plant.signals import Floats

FEWEST = 0.01
"""Share of repeated frames that occurs by chance and noise."""
FEW = 20
"""Updates from which a period can be identified."""
NEXT = 0.02
"""Share of updates in neighbouring frames that a hold of two frames and more may have, or two."""
KEPT = 0.7
"""Share of the coherence of exactly periodic updates from which updates count as periodic."""
CHANCE = 15.0
"""Updates times squared coherence; random updates exceed it once in exp(15) times. Also the log
likelihood ratio of two hazards against one."""
RARE = 0.5
"""Hazard soon after an update over the later one, from which updates do not count as periodic."""


@dataclass(frozen=True)
class Renewals:
    """late: sent value less the true one, where a frame was not updated, (k,).

    share: of the frames that were not updated while the value moved.
    """

    late: Floats
    share: float


def renewals(value: Floats, again: Floats, step: float) -> Renewals | None:
    """Frames that were not updated; None where so few are that it may be chance.

    value: true value at the frames, (k,); again: 1 where a frame repeats the one before it;
    step: a smaller change is no movement. A slow signal changes by less from frame to frame; its
    change since the last update counts.
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
    """Frames from one update to the next, 0 where updates are random or in every frame.

    again: 1 where a frame repeats the one before it, (k,).
    """
    fresh = again <= 0.5
    at = np.flatnonzero(fresh)
    if at.size < FEW or at.size > again.size / 1.1:
        return 0.0
    apart = np.diff(at[1:])  # the first frame may repeat one before the recording
    if not _less_than_two(apart):
        return _mean_interval(apart)
    # Less than two frames appear as their remaining line at one less their frequency (aliasing).
    return _strongest(fresh, 0.1, 0.5)


def _mean_interval(apart: np.ndarray) -> float:
    """Mean frames between updates, 0 where they are as frequent soon after an update as later.

    apart: frames between updates, of which the median is at least two.

    Longer intervals are left out: the value rested, or a frame was lost.
    """
    typical = float(np.median(apart))
    early, longest = typical // 2.0, 1.5 * typical
    soon, later = _updates(apart, 0.0, early), _updates(apart, early, longest)
    hazards = [events / frames for events, frames in (soon, later)]
    both = (soon[0] + later[0]) / (soon[1] + later[1])
    ratio = sum(_likelihood(*n) - _likelihood(*n, both) for n in (soon, later))
    periodic = hazards[0] < RARE * hazards[1] and ratio > CHANCE
    return float(np.mean(apart[apart <= longest])) if periodic else 0.0


def _updates(apart: np.ndarray, after: float, until: float) -> tuple[float, float]:
    """Updates at ages in (after, until] since the one before, and frames at these ages."""
    frames = np.clip(apart, after, until) - after
    return float(np.sum((apart > after) & (apart <= until))), float(np.sum(frames))


def _likelihood(updates: float, frames: float, hazard: float | None = None) -> float:
    """Log likelihood of updates in that many frames, nats. hazard: None: the most likely one."""
    hazard = updates / frames if hazard is None else hazard
    return float(special.xlogy(updates, hazard) + special.xlog1py(frames - updates, -hazard))


def _less_than_two(apart: np.ndarray) -> bool:
    """Whether the update period is below two frames, from frames between updates.

    A period just below two gives a few updates in neighbouring frames, one just above two a few
    gaps of three; both have the same line.
    """
    one, three = (int(np.sum(apart == n)) for n in (1, 3))
    about_two = np.median(apart) == 2 and one > three
    return one > 2 and (bool(about_two) or one > NEXT * apart.size)


def _strongest(fresh: np.ndarray, low: float, high: float) -> float:
    """The hold whose remaining line between two frequencies per frame is strongest, 0 if weak.

    A periodic update is late by up to a frame, which attenuates its line to sinc(1 / hold).
    """
    frequency, lines = _lines(fresh)
    inside = (frequency >= low) & (frequency <= high)
    best = int(np.argmax(lines[inside]))
    found, line = float(frequency[inside][best]), float(lines[inside][best])
    hold = 1.0 / (1.0 - found)
    strong = np.sum(fresh) * line**2 > CHANCE
    return hold if strong and line > KEPT * float(np.sinc(1.0 / hold)) else 0.0


def _lines(fresh: np.ndarray) -> tuple[Floats, Floats]:
    """Coherence of the updates with every frequency per frame, 1 where all are in phase."""
    length = 8 * fresh.size
    power = np.abs(np.fft.rfft(fresh.astype(float), length)) / np.sum(fresh)
    return np.asarray(np.fft.rfftfreq(length), np.float64), np.asarray(power)
