"""What happens to a motorcycle under slip control: target, road and rider, over time or place."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

Course = Callable[[float], float]
"""Of time (s) or of distance (m), both counted from the start of control."""


def steady(value: float) -> Course:
    """Return a course that never changes."""
    return lambda _: value


def between(start: float, end: float, inside: float, outside: float = 1.0) -> Course:
    """Return a course that has one value between two places and another elsewhere."""
    return lambda x: inside if start <= x < end else outside


def ramp(start: float, end: float, to: float) -> Course:
    """Return a course that rises from 0 to a value between two times."""
    return lambda t: to * min(max((t - start) / (end - start), 0.0), 1.0)


ONE, NOTHING = steady(1.0), steady(0.0)


@dataclass(frozen=True)
class Scenario:
    """target: slip, by time; grip, load: factors on friction and rear load, by distance; throttle:
    what the rider adds to the opening that holds the speed, by time; engine_speed: rad/s."""

    name: str
    duration: float
    target: Course
    grip: Course = ONE
    load: Course = ONE
    throttle: Course = NOTHING
    gear: int = 2
    engine_speed: float = 14000 * math.pi / 30


def slip_step(base: float, size: float = 0.0006, duration: float = 6.0) -> Scenario:
    """Steps of the wanted slip, up and down every second, about where it rests."""
    return Scenario(
        "slip step", duration, lambda t: base + (size if t >= 1.0 and int(t) % 2 else -size)
    )


def tracking(base: float, size: float = 0.0006) -> Scenario:
    """Slip that follows a sine of rising frequency, 0.5 to 14 Hz."""

    def wave(t: float) -> float:
        return base + size * math.sin(2 * math.pi * (0.5 * t + 0.5 * (13.5 / 14.0) * t * t))

    return Scenario("slip tracking", 14.0, wave)


def wet_patch(target: float, rider: float) -> Scenario:
    """Driving hard, half of the grip is gone for 20 m. rider: opening beyond cruising."""
    return Scenario(
        "wet patch",
        4.0,
        steady(target),
        grip=between(120.0, 140.0, 0.5),
        throttle=ramp(0.2, 0.7, rider),
    )


def crest(target: float, rider: float) -> Scenario:
    """Driving hard, the rear wheel carries half of its load for 15 m."""
    return Scenario(
        "crest",
        4.0,
        steady(target),
        load=between(120.0, 135.0, 0.5),
        throttle=ramp(0.2, 0.7, rider),
    )


def rolling_on(target: float, rider: float) -> Scenario:
    """The rider rolls on within 0.3 s, further than the tyre can carry."""
    return Scenario("rolling on", 4.0, steady(target), throttle=ramp(1.0, 1.3, rider))


def wet_road(target: float, rider: float) -> Scenario:
    """The same on a road with half of the grip: without control the wheel spins up."""
    return replace(rolling_on(target, rider), name="wet road", grip=steady(0.5))


def launch(target: float, rider: float) -> Scenario:
    """From low speed: second gear, 7 000 rpm, about 26 m/s; the rider rolls on within 0.3 s."""
    return Scenario(
        "launch",
        4.0,
        steady(target),
        throttle=ramp(0.2, 0.5, rider),
        engine_speed=7000 * math.pi / 30,
    )
