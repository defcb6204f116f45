"""A toothed wheel passes a pickup: the angle of the wheel becomes the times of its teeth.

A trial reads it piece by piece, an analysis in one go; both give the same teeth at the same ticks.
A tooth counts when its angle is reached, forwards or backwards; a wheel at rest gives nothing. The
trajectory must not turn back within one interval further than it returns: what counts is where the
wheel stands at the given times.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from slipbench.plant.blocks import Encoder
from slipbench.plant.compiled import entry, inlined, load, text_of
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import ParameterError
from slipbench.plant.signals import Floats

Integers = NDArray[np.int64]
PASS = "Tuple((i8[::1],i8[::1],i8[::1]))(f8[::1],f8[:],f8[:],f8[:],f8[::1],f8)"


@runtime_checkable
class Misplaces(Protocol):
    """An effect that moves teeth."""

    encoder: str

    def tooth_offsets(self, teeth: int) -> Floats:
        """Delay of every tooth against even spacing [rad], shape (teeth,)."""
        ...


@dataclass(frozen=True)
class ToothedDisc:
    """angles: where each tooth of one turn stands [rad], increasing; resolution: tick [s]."""

    angles: Floats
    resolution: float


@dataclass(frozen=True)
class Teeth:
    """Teeth that passed. ticks: times in units of the resolution, never decreasing.

    numbers: running number of the tooth (tooth k of the disc is number % teeth == k).
    directions: +1 forwards, -1 backwards; a plain pickup does not distinguish them.
    """

    ticks: Integers
    numbers: Integers
    directions: Integers


def toothed_disc(
    encoder: Encoder, effects: Iterable[Effect] = (), wheel: str = "rear_encoder"
) -> ToothedDisc:
    """Toothed disc of a wheel, with the effects that displace its teeth.

    Raises ParameterError where a tooth would pass its neighbour.
    """
    teeth = int(encoder.teeth)
    angles: Floats = 2 * np.pi / teeth * np.arange(teeth, dtype=np.float64)
    for effect in effects:
        if isinstance(effect, Misplaces) and effect.encoder == wheel:
            angles = angles + effect.tooth_offsets(teeth)
    gaps = np.diff(angles, append=angles[0] + 2 * np.pi)
    if gaps.min() <= 0.0:
        raise ParameterError(
            "a tooth is displaced beyond its neighbour",
            f"{wheel}, tooth {int(gaps.argmin())}",
            f"less than the pitch of {2e3 * np.pi / teeth:.0f} mrad",
            f"a gap of {1e3 * gaps.min():.0f} mrad",
            "displace it less",
        )
    return ToothedDisc(angles, encoder.resolution)


def begin(time: float, angle: float, speed: float) -> Floats:
    """Encoder state [time s, angle rad, speed rad/s], shape (3,), before the first tooth."""
    return np.array([time, angle, speed])


def passing_teeth(
    disc: ToothedDisc, state: Floats, time: Floats, angle: Floats, speed: Floats | None = None
) -> tuple[Floats, Teeth]:
    """The state after the trajectory, and the teeth that passed since the given state.

    time: s, increasing, later than the state's; angle: rad, cumulative; speed: rad/s, all of shape
    (n,). Between two times the angle is the cubic through positions and speeds; without speed it
    is the straight line. The given state is not changed.
    """
    if len(time) == 0:
        return state, Teeth(*(np.empty(0, np.int64) for _ in range(3)))
    rates = np.full(len(time), np.nan) if speed is None else speed
    found = _compiled().passages(state, time, angle, rates, disc.angles, disc.resolution)
    return np.array([time[-1], angle[-1], rates[-1]]), Teeth(*found)


@cache
def _compiled() -> ModuleType:
    parts = [inlined(text_of(f)) for f in (tooth_angle, teeth_below, share_of_interval)]
    return load("\n\n".join([*parts, entry(text_of(passages), PASS)]))


def tooth_angle(number: int, angles: Floats) -> float:
    """Angle of the tooth with this running number [rad]."""
    turn = math.floor(number / len(angles))
    return float(angles[number - turn * len(angles)] + 2.0 * math.pi * turn)


def teeth_below(angle: float, angles: Floats) -> int:
    """Running number of the first tooth beyond an angle (rad). angles: of the teeth, rad, (n,)."""
    number = math.floor(angle * len(angles) / (2.0 * math.pi)) + 1
    while tooth_angle(number, angles) <= angle:
        number += 1
    while tooth_angle(number - 1, angles) > angle:
        number -= 1
    return number


def share_of_interval(target: float, a: float, b: float, slope_a: float, slope_b: float) -> float:
    """The share of an interval at which the cubic from a to b reaches the target."""
    low, high = 0.0, 1.0
    s = (target - a) / (b - a)
    direction = 1.0 if b > a else -1.0
    for _ in range(20):
        p, q = slope_a - (b - a), slope_b - (b - a)
        miss = a + s * (b - a) + s * (1.0 - s) * ((1.0 - s) * p - s * q) - target
        if miss * direction > 0.0:
            high = s
        else:
            low = s
        slope = (b - a) + (1.0 - s) * (1.0 - 3.0 * s) * p - s * (2.0 - 3.0 * s) * q
        new = s - miss / slope if slope * direction > 0.0 else 0.5 * (low + high)
        if not low <= new <= high:
            new = 0.5 * (low + high)
        if abs(new - s) < 1e-13:
            return new
        s = new
    return s


def passages(
    state: Floats, time: Floats, angle: Floats, speed: Floats, angles: Floats, resolution: float
) -> tuple[Integers, Integers, Integers]:
    """Timer ticks, running numbers and directions of all teeth that pass, shape (m,) each.

    time: s; angle: rad; speed: rad/s, shape (n,) each; angles: of the teeth, rad; resolution: s.
    """
    total = 0
    count = teeth_below(state[1], angles)
    for i in range(len(time)):
        new = teeth_below(angle[i], angles)
        total += abs(new - count)
        count = new
    ticks = np.empty(total, np.int64)
    numbers = np.empty(total, np.int64)
    directions = np.empty(total, np.int64)
    t, a, v = state[0], state[1], state[2]
    count = teeth_below(a, angles)
    k = 0
    for i in range(len(time)):
        dt = time[i] - t
        straight = math.isnan(v) or math.isnan(speed[i])
        va = angle[i] - a if straight else v * dt
        vb = angle[i] - a if straight else speed[i] * dt
        new = teeth_below(angle[i], angles)
        direction = 1 if new > count else -1
        while count != new:
            number = count if direction > 0 else count - 1
            s = share_of_interval(tooth_angle(number, angles), a, angle[i], va, vb)
            ticks[k] = math.floor((t + s * dt) / resolution)
            numbers[k] = number
            directions[k] = direction
            k += 1
            count += direction
        t, a, v = time[i], angle[i], speed[i]
    return ticks, numbers, directions
