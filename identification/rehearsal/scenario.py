"""What happens to a motorcycle under slip control: target, road and rider, over time or place."""

import math
from collections.abc import Callable
from dataclasses import dataclass

Course = Callable[[float], float]
"""Of time (s) or of distance (m), both counted from the start of control."""


def steady(value: float) -> Course:
    """Return a course that never changes."""
    return lambda _: value


def between(start: float, end: float, inside: float, outside: float = 1.0) -> Course:
    """Return a course that has one value between two places and another elsewhere."""
    return lambda x: inside if start <= x < end else outside


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


def slip_step(base: float, size: float = 0.003) -> Scenario:
    """Steps of the wanted slip, up and down every second."""
    return Scenario("slip step", 6.0, lambda t: base + (size if int(t) % 2 else 0.0))


def tracking(base: float, size: float = 0.002) -> Scenario:
    """Slip that follows a sine of rising frequency, 0.5 to 8 Hz."""
    return Scenario(
        "slip tracking", 12.0,
        lambda t: base + size * math.sin(2 * math.pi * (0.5 * t + 0.5 * 7.5 / 12.0 * t * t)),
    )  # fmt: skip


def wet_patch(target: float, at: float = 60.0, length: float = 20.0) -> Scenario:
    """Half of the grip is gone for 20 m."""
    return Scenario("wet patch", 4.0, steady(target), grip=between(at, at + length, 0.5))


def crest(target: float, at: float = 60.0, length: float = 15.0) -> Scenario:
    """The rear wheel carries 60 % of its load for 15 m."""
    return Scenario("crest", 4.0, steady(target), load=between(at, at + length, 0.6))


def rolling_on(target: float, more: float = 0.03) -> Scenario:
    """The rider rolls on within half a second, as far as the controller lets it through."""
    return Scenario(
        "rolling on",
        4.0,
        steady(target),
        throttle=lambda t: more * min(max(t - 1.0, 0.0) / 0.5, 1.0),
    )


def launch(target: float) -> Scenario:
    """From low speed: second gear, 6 000 rpm, about 23 m/s."""
    return Scenario("launch", 4.0, steady(target), engine_speed=6000 * math.pi / 30)
