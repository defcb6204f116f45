"""Gear and speed at which a trial fits into a straight."""

import math
from dataclasses import dataclass
from pathlib import Path

from slipbench.bench.vehicle.virtual_motorcycle import read_vehicle
from slipbench.protocol.errors import InputError
from slipbench.protocol.quantity import read_quantity
from slipbench.protocol.straight import AFTERWARDS, BEFORE, BRAKING, DRIFT, SHORTEST, WINDOW, room
from slipbench.protocol.trial_file import RPM

SLOWEST = 0.5  # of the speed of peak torque: racing engines are not ridden below it
FEWEST_METRES, MOST_METRES = 50.0, 9000.0


@dataclass(frozen=True)
class Fitting:
    """An operating point and the time for an excitation.

    gear; engine_speed: rad/s; speed: m/s, without slip; duration: s of excitation; distance: m
    from the button to where the rider has to brake
    """

    gear: int
    engine_speed: float
    speed: float
    duration: float
    distance: float


def fittings(vehicle: Path, straight: float) -> list[Fitting]:
    """Operating points that fit into a straight (m), the best first.

    The best is the nearest to the speed of peak torque, and of these the one with the longest
    excitation. First gear only where the vehicle has no other: its wheel torque lifts the front.
    Raises InputError where the straight is too short for every gear.
    """
    motorcycle = read_vehicle(vehicle).motorcycle
    radius, preferred = motorcycle.rear_wheel.radius, motorcycle.engine.peak_speed
    found = []
    for gear, ratio in enumerate(motorcycle.gears, start=1):
        if gear == 1 and len(motorcycle.gears) > 1:
            continue
        fastest = _fastest(straight) * ratio / radius
        engine_speed = _rounded_down(min(preferred, fastest))
        if engine_speed < SLOWEST * preferred:
            continue
        found.append(_fitting(gear, engine_speed, engine_speed * radius / ratio, straight))
    if not found:
        raise InputError(
            "the straight is too short for this motorcycle",
            where=str(vehicle),
            expected=f"at least {_shortest(motorcycle.gears, preferred, radius):.0f} m",
            found=f"{straight:g} m",
            remedy="find a longer straight, or a vehicle file with shorter gears",
        )
    return sorted(found, key=lambda one: (-round(one.engine_speed, 3), -one.duration))


def length_of(text: str) -> float:
    """Length of a straight, m, from text such as "900m". Raises InputError where it is none."""
    try:
        length = read_quantity(text, "m")
    except ValueError as cause:
        raise InputError(str(cause), where="--straight", found=text) from cause
    if FEWEST_METRES <= length <= MOST_METRES:
        return float(length)
    raise InputError(
        "no straight has this length",
        where="--straight",
        expected=f"{FEWEST_METRES:g} to {MOST_METRES:g} m",
        found=f"{length:g} m",
        remedy="give the length in m",
    )


def _fitting(gear: int, engine_speed: float, speed: float, straight: float) -> Fitting:
    duration, distance = room(speed, straight)
    return Fitting(gear, engine_speed, speed, duration, distance)


def _fastest(straight: float) -> float:
    """Speed (m/s) at which the shortest excitation just fits: v t + v^2 / (2 b) = straight."""
    time = BEFORE + AFTERWARDS + SHORTEST
    widened = BRAKING * (math.sqrt(time**2 + 2 * straight / BRAKING) - time)
    return widened / (1 + WINDOW + DRIFT)


def _shortest(gears: tuple[float, ...], preferred: float, radius: float) -> float:
    """Shortest straight that has an operating point, m."""
    ratio = max(gears[1:] or gears)
    fastest = SLOWEST * preferred * radius / ratio * (1 + WINDOW + DRIFT) + 0.5
    return fastest * (BEFORE + AFTERWARDS + SHORTEST) + fastest**2 / (2 * BRAKING)


def _rounded_down(engine_speed: float) -> float:
    """Crank speed of whole hundreds of rpm, rad/s."""
    return math.floor(engine_speed / RPM / 100) * 100 * RPM
