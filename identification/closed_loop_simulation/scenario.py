"""Scenarios of the closed-loop simulation: setpoint, road and rider over time or distance."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

Profile = Callable[[float], float]
"""Function of time (s) or distance (m), both from the start of control."""


def steady(value: float) -> Profile:
    """Constant profile."""
    return lambda _: value


def between(start: float, end: float, inside: float, outside: float = 1.0) -> Profile:
    """Profile with one value from start to end and another outside."""
    return lambda x: inside if start <= x < end else outside


def ramp(start: float, end: float, to: float) -> Profile:
    """Profile that rises linearly from 0 to a value between two times (s)."""
    return lambda t: to * min(max((t - start) / (end - start), 0.0), 1.0)


ONE, NOTHING = steady(1.0), steady(0.0)


@dataclass(frozen=True)
class Scenario:
    """target: slip over time; grip, load: factors of friction and rear load over distance; throttle:
    opening that the rider adds to the steady one, over time; duration: s; engine_speed: rad/s."""

    name: str
    duration: float
    target: Profile
    grip: Profile = ONE
    load: Profile = ONE
    throttle: Profile = NOTHING
    gear: int = 2
    engine_speed: float = 14000 * math.pi / 30


def slip_step(base: float, size: float = 0.0006, duration: float = 6.0) -> Scenario:
    """Setpoint steps up and down every second about the steady-state slip."""
    return Scenario(
        "slip step", duration, lambda t: base + (size if t >= 1.0 and int(t) % 2 else -size)
    )


def tracking(base: float, size: float = 0.0006) -> Scenario:
    """Setpoint sweep, a sine from 0.5 to 14 Hz."""

    def wave(t: float) -> float:
        return base + size * math.sin(2 * math.pi * (0.5 * t + 0.5 * (13.5 / 14.0) * t * t))

    return Scenario("slip tracking", 14.0, wave)


def wet_patch(target: float, rider: float) -> Scenario:
    """High throttle with half the grip for 20 m. rider: opening above cruising."""
    return Scenario(
        "wet patch",
        4.0,
        steady(target),
        grip=between(120.0, 140.0, 0.5),
        throttle=ramp(0.2, 0.7, rider),
    )


def crest(target: float, rider: float) -> Scenario:
    """High throttle with half the rear wheel load for 15 m."""
    return Scenario(
        "crest",
        4.0,
        steady(target),
        load=between(120.0, 135.0, 0.5),
        throttle=ramp(0.2, 0.7, rider),
    )


def rolling_on(target: float, rider: float) -> Scenario:
    """The rider opens the throttle within 0.3 s beyond the grip of the tyre."""
    return Scenario("rolling on", 4.0, steady(target), throttle=ramp(1.0, 1.3, rider))


def wet_road(target: float, rider: float) -> Scenario:
    """Rolling on with half the grip: without control the wheel spins up."""
    return replace(rolling_on(target, rider), name="wet road", grip=steady(0.5))


def launch(target: float, rider: float) -> Scenario:
    """Launch: second gear, 7 000 rpm, about 26 m/s; the throttle opens within 0.3 s."""
    return Scenario(
        "launch",
        4.0,
        steady(target),
        throttle=ramp(0.2, 0.5, rider),
        engine_speed=7000 * math.pi / 30,
    )
