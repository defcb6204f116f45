"""The speed of a wheel from the times of its teeth, each between two fixed positions.

Between two teeth the wheel turns 2 pi / N; the time TT that it takes gives the mean speed over the
interval, w = 2 pi / (N TT) (Corno and Savaresi 2009). It is placed at the middle of the interval,
where it is right to second order. An encoder that speaks at each tooth knows it half an interval
late and holds it for one interval: on average the speed that it shows is TT old.
"""

from typing import overload

import numpy as np

from slipbench.controllers.pitch_learner import STANDING_AFTER, TIMER
from slipbench.identification.signals.samples import BoolArray, Samples
from slipbench.protocol.recording.channel import FloatArray


def speed_from_teeth(
    time: FloatArray,
    count: FloatArray,
    teeth_per_turn: int,
    origin: str = "",
    gaps: FloatArray | None = None,
) -> Samples:
    """Wheel speed at the middle of each tooth interval.

    time: s, (n,); count: running tooth count, (n,). Returns rad/s. Where the count does not step by
    one, teeth are unknown and there is a gap; nothing is averaged over it. An interval longer than
    `STANDING_AFTER` is a standstill. gaps: (teeth_per_turn,), how much longer than even each gap
    between teeth is (`signals.tooth_pitch`); None takes them as equal. With gaps, the mean
    over an interval becomes the speed at its middle; else that would sharpen the teeth's errors.
    """
    fresh = np.concatenate(([True], np.diff(count) != 0))[: time.size]
    time, count = time[fresh], count[fresh]
    interval, step = np.diff(time), np.diff(count)
    good = (step == 1) & (interval > 0)
    middle = time[:-1] + interval / 2
    speed = np.zeros_like(interval)
    np.divide(_angles(count, teeth_per_turn, gaps), interval, out=speed, where=good)
    if gaps is not None:
        speed = _at_middle(speed, interval, good)
    moving = good & (interval <= STANDING_AFTER)
    standing = time[:-1][good & ~moving], time[1:][good & ~moving]
    return _assembled(middle[moving], speed[moving], standing, time[:-1][~good], origin)


def _angles(count: FloatArray, teeth: int, gaps: FloatArray | None) -> FloatArray:
    """Angle of each gap, rad, (n - 1,)."""
    even = 2 * np.pi / teeth
    if gaps is None:
        return np.full(max(count.size - 1, 0), even)
    tooth = np.mod(np.round(np.nan_to_num(count[:-1])).astype(np.int64), teeth)
    return np.asarray(even * (1 + gaps[tooth]))


def _at_middle(speed: FloatArray, interval: FloatArray, good: BoolArray) -> FloatArray:
    """Undo the mean over an interval: w(middle) = mean - w'' TT^2 / 24, w'' from its neighbours.

    A mean over TT loses (pi f TT)^2 / 6 of a sine, 2 % at 14 Hz and 8 ms.
    """
    inside = good[1:-1] & good[:-2] & good[2:]
    apart = np.where(inside, (interval[1:-1] + (interval[:-2] + interval[2:]) / 2) / 2, 1.0)
    after = np.where(inside, (interval[1:-1] + interval[2:]) / 2, 1.0)
    before = np.where(inside, (interval[1:-1] + interval[:-2]) / 2, 1.0)
    rises = (speed[2:] - speed[1:-1]) / after - (speed[1:-1] - speed[:-2]) / before
    sharp = speed.copy()
    sharp[1:-1] -= np.where(inside, rises / apart * interval[1:-1] ** 2 / 24, 0.0)
    return sharp


def _assembled(
    middle: FloatArray,
    speed: FloatArray,
    standing: tuple[FloatArray, FloatArray],
    unknown_from: FloatArray,
    origin: str,
) -> Samples:
    margin = STANDING_AFTER / 2
    zero = np.concatenate((standing[0] + margin, standing[1] - margin))
    time = np.concatenate((middle, zero))
    value = np.concatenate((speed, np.zeros_like(zero)))
    order = np.argsort(time, kind="stable")
    time, value = time[order], value[order]
    gap = np.zeros(max(time.size - 1, 0), dtype=np.bool_)
    before = np.searchsorted(time, unknown_from) - 1
    gap[before[(before >= 0) & (before < gap.size)]] = True
    return Samples(time, value, gap, origin)


@overload
def tooth_interval(speed: float, radius: float, teeth_per_turn: int) -> float: ...
@overload
def tooth_interval(speed: FloatArray, radius: float, teeth_per_turn: int) -> FloatArray: ...
def tooth_interval(
    speed: FloatArray | float, radius: float, teeth_per_turn: int
) -> FloatArray | float:
    """TT at a peripheral speed. speed: m/s, radius: m. Returns s."""
    return 2 * np.pi * radius / (teeth_per_turn * speed)


def delay(speed: FloatArray, radius: float, teeth_per_turn: int) -> FloatArray:
    """Mean delay of an encoder's speed in s, shape (n,): half an interval measured, half held.

    speed: peripheral, m/s, shape (n,); radius: m.
    """
    return tooth_interval(speed, radius, teeth_per_turn)


def error_bound(
    speed: FloatArray, radius: float, teeth_per_turn: int, timer: float = TIMER
) -> FloatArray:
    """Bound on the relative error of a speed from two tooth times, dimensionless, shape (n,).

    speed: peripheral, m/s, shape (n,); radius: m; timer: resolution of the times, s.
    Both ends may be off by half a step: abs(dw / w) <= dt / (TT - dt), about dt / TT.
    """
    interval = tooth_interval(speed, radius, teeth_per_turn)
    return timer / np.maximum(interval - timer, timer)
