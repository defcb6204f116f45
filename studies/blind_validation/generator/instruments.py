"""Measurements of a simulated run: samples on the devices' clocks, filtered, with noise and quanta."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from slipbench.studies.blind_validation.generator.filters import (
    Filter,
    filtered,
    low_pass,
    moving_mean,
)
from slipbench.studies.blind_validation.generator.physics import Floats
from slipbench.studies.blind_validation.generator.ride import Commands, Course
from slipbench.studies.blind_validation.generator.vehicle_file import Noises

TEETH = 16
EVEN = 2 * np.pi / TEETH * np.arange(TEETH)  # rad, places of the teeth
TOLERANCE = 1e-6  # m, standard deviation of a tooth's place: a tenth of what anybody cares for
PITCH_RADIUS = 0.1  # m
DRIFT = 30e-6
PERIODS = {"throttle_position": 1e-3, "engine_speed": 5e-3, "optical_speed": 4e-3}
COLUMNS = {"throttle_position": "plate", "engine_speed": "crank_speed", "optical_speed": "optical"}


@dataclass(frozen=True)
class ChannelFaults:
    """Hidden effects on a channel: time constants in s, quantum in the channel's unit.

    jitter: share by which each hold is longer or shorter; drift: scale error per 10 s; wave: error
    that is periodic with the value.
    """

    latency: float = 0.0
    lag: float = 0.0
    error: float = 0.0
    quantum: float = 0.0
    hold: float = 0.0
    stale: float = 0.0
    jitter: float = 0.0
    window: float = 0.0
    drift: float = 0.0
    wave: float = 0.0
    wave_period: float = 0.05


@dataclass(frozen=True)
class Disc:
    """Hidden errors of a toothed disc. displacement: m of one tooth; run_out: relative."""

    displacement: float = 0.0
    tooth: int = 0
    run_out: float = 0.0
    order: int = 1
    phase: float = 0.0


@dataclass(frozen=True)
class Sensors:
    """Hidden effects of the sensors, by channel and by wheel."""

    channels: Mapping[str, ChannelFaults] = field(default_factory=dict)
    discs: Mapping[str, Disc] = field(default_factory=dict)


@dataclass(frozen=True)
class Clock:
    """A device's clock: offset s ahead at the start, drift s/s fast."""

    offset: float
    drift: float

    def read(self, time: Floats) -> Floats:
        """Clock readings, s, at true times, s; shape (n,)."""
        return self.offset + time * (1.0 + self.drift)


@dataclass(frozen=True)
class Samples:
    """true: s, when each sample was taken; value: SI."""

    true: Floats
    value: Floats


def draw_clock(rng: np.random.Generator) -> Clock:
    """Clock of a device that was switched on at a random time before."""
    return Clock(float(rng.uniform(0.5, 12.0)), float(rng.normal(0.0, DRIFT)))


def sampled(
    channel: str,
    trajectory: Course,
    noises: Noises,
    faults: ChannelFaults,
    rng: np.random.Generator,
    own: Filter | None = None,
) -> Samples:
    """Samples of a channel at its own period. own: the sensor's own filter, which the file states."""
    period = PERIODS[channel]
    phase = float(rng.uniform(0.1, 1.0)) * period
    time = np.arange(phase + 0.01, trajectory.time[-1] - 2e-3, period)
    signal, step = (
        getattr(trajectory, COLUMNS[channel]),
        float(trajectory.time[1] - trajectory.time[0]),
    )
    if own:
        signal = filtered(signal, step, own)
    if faults.lag:
        signal = low_pass(signal, step, faults.lag)
    if faults.window:
        signal = moving_mean(signal, step, faults.window)
    value = np.interp(time - faults.latency, trajectory.time, signal)
    value = value + faults.wave * np.sin(2.0 * np.pi * value / faults.wave_period)
    value = value * (1.0 + faults.error + 0.1 * faults.drift * time)
    noise, quantum = {
        "throttle_position": (noises.throttle, noises.throttle_quantum),
        "engine_speed": (noises.engine_speed, 0.0),
        "optical_speed": (noises.optical, 0.0),
    }[channel]
    value = value + noise * rng.standard_normal(time.size)
    for step in (faults.quantum, quantum):
        value = step * np.round(value / step) if step else value
    return Samples(time, _repeated(time, value, faults, rng))


def _repeated(
    time: Floats, value: Floats, faults: ChannelFaults, rng: np.random.Generator
) -> Floats:
    """Values, each repeated until the next update."""
    fresh = np.ones(time.size, np.bool_)
    if faults.hold:
        count = int(time[-1] / faults.hold / (1.0 - faults.jitter)) + 2
        length = faults.hold * (1.0 + faults.jitter * rng.uniform(-1.0, 1.0, count))
        renewed = np.cumsum(length) - rng.uniform(0.0, faults.hold)
        fresh &= np.diff(np.searchsorted(renewed, time), prepend=-1) != 0
    if faults.stale:
        fresh &= rng.uniform(size=time.size) >= faults.stale
    fresh[0] = True
    return np.asarray(value[np.maximum.accumulate(np.where(fresh, np.arange(time.size), 0))])


def echoed(values: Floats, commands: Commands) -> Samples:
    """Commands that the ECU reports at every tick, SI. values: one per tick, shape (n,)."""
    return Samples(np.asarray(commands.period * np.arange(values.size), np.float64), values)


def tooth_places(disc: Disc, rng: np.random.Generator) -> Floats:
    """Angle of every tooth of a disc, rad, shape (TEETH,): even spacing, tolerance, hidden errors."""
    tolerance = TOLERANCE / PITCH_RADIUS * rng.standard_normal(TEETH)
    return np.asarray(EVEN + tolerance + hidden_errors(disc))


def hidden_errors(disc: Disc) -> Floats:
    """Angle by which every tooth passes later by the hidden errors of a disc, rad, shape (TEETH,)."""
    late = disc.run_out / disc.order * np.cos(disc.order * EVEN + disc.phase)
    late[disc.tooth] += disc.displacement / PITCH_RADIUS
    return np.asarray(late)


def tooth_times(
    wheel: str, trajectory: Course, places: Floats, noises: Noises, rng: np.random.Generator
) -> tuple[Floats, int]:
    """True times (s) at which teeth pass, with the pickup's jitter, and index of the first tooth."""
    rear = wheel == "rear"
    speed = trajectory.wheel_speed if rear else trajectory.front_speed
    angle = trajectory.wheel if rear else trajectory.front
    first, last = (int(a / (2 * np.pi) * TEETH) for a in (angle[0], angle[-1]))
    number = np.arange(first + 2, last - 1)
    target = places[number % TEETH] + 2 * np.pi * (number // TEETH)
    time = np.interp(target, angle, trajectory.time)
    spline = CubicHermiteSpline(trajectory.time, angle, speed)
    for _ in range(2):
        time = time - (spline(time) - target) / np.interp(time, trajectory.time, speed)
    keep = time > 0.005
    time, number = time[keep], number[keep]
    return np.sort(time + noises.jitter * rng.standard_normal(time.size)), int(number[0])
