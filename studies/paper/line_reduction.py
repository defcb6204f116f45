"""Reduction of the wheel orders by each filter, and its phase lag.

Four methods on one recording: zero-phase notch (forwards and backwards), causal notch, tooth pitch
learnt offline, and tooth pitch learnt online. All are evaluated on the second half of the
recording; the tooth pitch is learnt on the first half.

    found = line_reductions(identified)          # an Identification
    if isinstance(found, LineReductions):
        claims = reduction_claims(found)
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from slipbench.controllers.causal_filters import (
    Notch,
    notched_online,
    smoothed_online,
    wheel_follower,
)
from slipbench.controllers.pitch_learner import PitchLearner
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.dataset import Dataset
from slipbench.identification.signals.filters import bridged
from slipbench.identification.signals.motion import Motion, notched, passing_orders
from slipbench.identification.signals.samples import Samples, smoothly
from slipbench.identification.signals.teeth import speed_from_teeth
from slipbench.identification.signals.tooth_pitch import NoToothPitch, learn_pitch
from slipbench.identification.signals.true_teeth import inputs
from slipbench.protocol.recording.channel import FloatArray
from slipbench.studies.paper.claims import Claim
from slipbench.studies.paper.wheel_orders import driven_angle, order_amplitudes, relative

ORDERS = (1, 2, 3, 4, 5, 6, 7, 8)
OFFLINE, ONLINE = "notch, zero phase", "notch, online"
LEARNT, LEARNING = "tooth pitch compensated", "tooth pitch compensated online"


@dataclass(frozen=True)
class LineReductions:
    """Amplitudes of wheel orders in the second half of a recording.

    orders     wheel orders, once per turn first
    notched    those of them that the notches reduce
    raw        (k,) amplitude over speed before any filter
    remaining  method -> (k,) the same after it
    frequency  Hz, mean of the wheel's
    rate       Hz, of the samples
    cleaned    method -> (n,) m/s on the recording's time base
    """

    orders: tuple[int, ...]
    notched: tuple[int, ...]
    raw: FloatArray
    remaining: Mapping[str, FloatArray]
    frequency: float
    rate: float
    cleaned: Mapping[str, FloatArray]

    def decibels(self, way: str) -> FloatArray:
        """Reduction of each order, dB, shape (k,)."""
        return np.asarray(20 * np.log10(self.raw / np.maximum(self.remaining[way], 1e-12)))

    def family(self, way: str) -> float:
        """Reduction of the root sum of squares of all orders, dB."""
        whole = np.sum(self.raw**2) / max(float(np.sum(self.remaining[way] ** 2)), 1e-24)
        return float(10 * np.log10(whole))


def line_reductions(
    found: Identification, orders: tuple[int, ...] = ORDERS
) -> LineReductions | NoToothPitch:
    """Wheel orders before and after each of the four methods."""
    moved = found.motion
    if not isinstance(moved, Motion) or moved.wheel_frequency is None or not moved.axle.radius:
        return NoToothPitch("the driven wheel was not timed tooth by tooth")
    assert moved.axle.teeth_per_turn is not None
    role = f"{moved.axle.axle}_teeth"
    time, count = found.data.time[role], found.recording.channels[role].value
    teeth = _by_teeth(time, count, moved.axle.teeth_per_turn, found.base)
    if isinstance(teeth, NoToothPitch):
        return teeth
    wheel = float(np.nanmean(moved.wheel_frequency))
    taken = passing_orders(wheel)
    cleaned = _by_notches(moved, found.base.rate, taken, moved.axle.radius) | {
        way: smoothly(part.scaled(moved.axle.radius), found.base.time)
        for way, part in teeth.items()
    }
    half = found.base.time > (time[0] + time[-1]) / 2
    angle = driven_angle(found)

    def read(speed: FloatArray) -> FloatArray:
        return order_amplitudes(relative(speed, found.base.rate)[half], angle[half], orders)

    remaining = {way: read(speed) for way, speed in cleaned.items()}
    rate = found.base.rate
    return LineReductions(orders, taken, read(moved.raw), remaining, wheel, rate, cleaned)


def _by_notches(
    moved: Motion, rate: float, orders: tuple[int, ...], radius: float
) -> dict[str, FloatArray]:
    assert moved.wheel_frequency is not None
    raw = bridged(moved.raw)
    led = smoothed_online(raw, wheel_follower(rate)) / (2 * np.pi * radius)
    online = notched_online(raw, led, Notch(rate, orders))
    return {
        OFFLINE: notched(moved.raw, moved.wheel_frequency, rate, orders),
        ONLINE: np.where(np.isfinite(moved.raw), online, np.nan),
    }


def _by_teeth(
    time: FloatArray, count: FloatArray, teeth: int, base: Dataset
) -> dict[str, Samples] | NoToothPitch:
    first = time < (time[0] + time[-1]) / 2
    pitch = learn_pitch(time[first], count[first], teeth, inputs(base))
    if isinstance(pitch, NoToothPitch):
        return pitch
    learnt = speed_from_teeth(time, count, teeth, gaps=pitch.gaps)
    return {LEARNT: learnt, LEARNING: _learning(time, count, teeth)}


def _learning(time: FloatArray, count: FloatArray, teeth: int) -> Samples:
    """Speed from the online learner, tooth by tooth, at the middle of each interval."""
    learner = PitchLearner(teeth)
    state = learner.initial()
    speed = np.empty(time.size)
    for index, (t, k) in enumerate(zip(time.tolist(), count.tolist(), strict=True)):
        speed[index], state = learner.update(state, t, k)
    known = np.isfinite(speed[1:])
    middle = (time[:-1] + time[1:]) / 2
    lost = np.diff(np.flatnonzero(known)) > 1
    return Samples(middle[known], speed[1:][known], lost, "learnt online")


def reduction_claims(found: LineReductions, frequency: float = 10.0) -> tuple[Claim, ...]:
    """Claims on the paper's figure 3 and beyond it. frequency: Hz, at which phase is evaluated."""
    table = "; ".join(
        f"{way}: {', '.join(f'{x:.0f}' for x in found.decibels(way))} dB" for way in found.remaining
    )
    price = Notch(found.rate, (1,)).response(np.array([frequency]), found.frequency)
    phase = float(np.degrees(np.abs(np.angle(price[0]))))
    return (
        Claim(
            "notch_takes_the_line",
            "the adaptive notch removes the first order",
            float(found.decibels(OFFLINE)[0]),
            20.0,
            np.inf,
            "dB",
            "figure 3",
            table,
        ),
        Claim(
            "online_notch_takes_the_line",
            "so does the causal notch for a controller",
            float(found.decibels(ONLINE)[0]),
            20.0,
            np.inf,
            "dB",
            "figure 3",
            table,
        ),
        Claim(
            "learnt_teeth_take_the_family",
            "tooth-pitch compensation removes all orders",
            found.family(LEARNT),
            30.0,
            np.inf,
            "dB",
            "beyond figure 3",
            f"orders {found.orders[0]} to {found.orders[-1]}, learnt on the first half, read on "
            f"the second; {table}",
        ),
        Claim(
            "online_notch_phase",
            f"away from the order, at {frequency:g} Hz, the phase lag is small",
            phase,
            0.0,
            5.0,
            "°",
            "figure 3",
            f"the wheel turns at {found.frequency:.1f} Hz",
        ),
    )
