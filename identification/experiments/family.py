"""The trials among which a design is sought: points of operation, waveforms and bands."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from slipbench.identification.experiments.bounds import Bounds
from slipbench.identification.mismatch.motorcycle.menu import RPM, Choice, menu
from slipbench.plant.motorcycle import Motorcycle
from slipbench.protocol.straight import MARGIN, SHORTEST, WINDOW

SPEEDS = 3
"""Engine speeds in each gear, from the lowest to the highest that limits and straight permit."""
BAND = (0.5, 14.0)
"""Hz, of sweeps and multisines, to begin with."""
STEPS = 0.8
"""Hz, of square waves, to begin with."""
LONGEST = 12.0
"""Seconds of excitation: evidence grows in proportion to them, as it does with another run."""
STEADY = 0.9
"""Share of what the margin leaves of a range, that steady riding may use."""
FULL = 1.0
"""Amplitude to begin with, far above what any limit permits: opening, or rad."""


def operating_points(bike: Motorcycle, bounds: Bounds) -> Iterator[tuple[int, float, float]]:
    """Gears, engine speeds (rad/s) and the longest excitation there (s) within limits and straight.

    First gear only where the vehicle has no other: its wheel torque lifts the front.
    """
    for gear in range(1, len(bike.gears) + 1):
        if gear == 1 and len(bike.gears) > 1:
            continue
        low, high = speed_range(bike, gear, bounds)
        if low > high:
            continue
        for speed in np.linspace(low, high, SPEEDS):
            yield gear, _whole(float(speed)), longest(bike, gear, float(speed), bounds)


def longest(bike: Motorcycle, gear: int, engine_speed: float, bounds: Bounds) -> float:
    """Seconds of excitation that fit at an engine speed (rad/s) in a gear, up to LONGEST."""
    return min(
        bounds.seconds(engine_speed * bike.rear_wheel.radius / bike.gears[gear - 1]), LONGEST
    )


def speed_range(bike: Motorcycle, gear: int, bounds: Bounds) -> tuple[float, float]:
    """Lowest and highest engine speed (rad/s) that a trial in a gear may be ridden at.

    The window within which the rider arms lies inside the limits, and the shortest excitation fits
    into the straight; empty (low above high) where nothing does.
    """
    per_turn = bike.rear_wheel.radius / bike.gears[gear - 1]
    turning, riding = _inner(bounds.limits.engine_speed), _inner(bounds.limits.speed)
    low = max(turning[0], riding[0] / per_turn) / (1.0 - WINDOW)
    high = min(turning[1], riding[1] / per_turn) / (1.0 + WINDOW)
    while high > low and bounds.seconds(high * per_turn) < SHORTEST:
        high -= 50.0 * RPM
    return low, high


def _inner(limits: tuple[float, float]) -> tuple[float, float]:
    """Range that steady riding may use: what the margin leaves, less a reserve for the trial."""
    middle, half = 0.5 * (limits[0] + limits[1]), 0.5 * (limits[1] - limits[0])
    return middle - STEADY * (1.0 - MARGIN) * half, middle + STEADY * (1.0 - MARGIN) * half


def _whole(engine_speed: float) -> float:
    """Engine speed in whole tens of rpm, as a trial file states it, rad/s."""
    return round(engine_speed / RPM / 10.0) * 10.0 * RPM


def trials(bike: Motorcycle, bounds: Bounds, actuators: tuple[str, ...]) -> Iterator[Choice]:
    """Trials at every operating point: each actuator with every waveform, as long as it fits."""
    for gear, speed, seconds in operating_points(bike, bounds):
        for actuator in actuators:
            for waveform in ("linear_sweep", "multisine"):
                yield Choice(gear, speed, actuator, waveform, FULL, *BAND, seconds)
            rate = bounds.rate(actuator)
            yield Choice(gear, speed, actuator, "square", FULL, STEPS, 14.0, seconds, rate)


def menu_trials(bike: Motorcycle, bounds: Bounds, actuators: tuple[str, ...]) -> Iterator[Choice]:
    """Trials of the fixed menu that limits and straight permit, shortened where they do not fit."""
    for choice in menu(len(bike.gears)):
        low, high = speed_range(bike, choice.gear, bounds)
        if choice.actuator in actuators and low <= choice.engine_speed <= high:
            seconds = longest(bike, choice.gear, choice.engine_speed, bounds)
            yield replace(choice, seconds=seconds, rate=bounds.rate(choice.actuator))
