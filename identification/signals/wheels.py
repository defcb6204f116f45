"""The peripheral speed of an axle, from whatever its wheels carry: teeth, a counter, a speed."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from slipbench.identification.signals.aligned import Aligned
from slipbench.identification.signals.samples import Samples
from slipbench.identification.signals.teeth import speed_from_teeth
from slipbench.identification.signals.tooth_counter import teeth_per_second

WRAP = 256  # a counter whose role map gives no modulo is taken to be a byte


@dataclass(frozen=True)
class AxleSpeed:
    """Speed of an axle's wheels.

    parts           one set of samples per wheel, m/s; averaged once they share a time base
    method          how it was measured, for people
    teeth_per_turn  None where it was not timed tooth by tooth
    radius          m, None where the vehicle gave peripheral speed itself
    """

    axle: str
    parts: tuple[Samples, ...]
    method: str
    teeth_per_turn: int | None = None
    radius: float | None = None


@dataclass(frozen=True)
class NoAxleSpeed:
    """Why an axle's speed is not known."""

    axle: str
    reason: str
    roles: tuple[str, ...]


def axle_speed(data: Aligned, axle: str) -> AxleSpeed | NoAxleSpeed:
    """The speed of "rear" or "front", from the finest source that the recording has."""
    refusals: list[str] = []
    for source in (_from_teeth, _from_speed, _from_left_and_right, _from_counter):
        found = source(data, axle)
        if isinstance(found, AxleSpeed):
            return found
        if found:
            refusals.append(found)
    return NoAxleSpeed(axle, "; ".join(refusals), tuple(f"{axle}_{w}" for w in _SOURCES))


_SOURCES = ("teeth", "wheel_speed", "tooth_counter")
Source = Callable[[Aligned, str], AxleSpeed | str]


def _from_teeth(data: Aligned, axle: str) -> AxleSpeed | str:
    role = f"{axle}_teeth"
    if not data.has(role):
        return data.absent.get(role, "")
    shape = _wheel(data, axle, role)
    if isinstance(shape, str):
        return shape
    teeth, radius = shape
    channel = data.recording.channels[role]
    turning = speed_from_teeth(data.time[role], channel.value, teeth, channel.origin)
    method = f"{teeth} teeth timed to 1 µs, fixed-position formula, radius {radius:g} m"
    return AxleSpeed(axle, (turning.scaled(radius),), method, teeth, radius)


def _from_speed(data: Aligned, axle: str) -> AxleSpeed | str:
    role = f"{axle}_wheel_speed"
    if not data.has(role):
        return data.absent.get(role, "")
    samples = data.samples(role)
    return AxleSpeed(axle, (samples,), f"wheel speed as the vehicle sends it ({samples.origin})")


def _from_left_and_right(data: Aligned, axle: str) -> AxleSpeed | str:
    roles = [f"{axle}_{side}_wheel_speed" for side in ("left", "right")]
    have = [role for role in roles if data.has(role)]
    if not have:
        return "; ".join(data.absent[role] for role in roles if role in data.absent)
    sides = "mean of left and right wheel" if len(have) == 2 else have[0].replace("_", " ")
    return AxleSpeed(axle, tuple(data.samples(role) for role in have), sides)


def _from_counter(data: Aligned, axle: str) -> AxleSpeed | str:
    role = f"{axle}_tooth_counter"
    if not data.has(role):
        return data.absent.get(role, "")
    shape = _wheel(data, axle, role)
    if isinstance(shape, str):
        return shape
    teeth, radius = shape
    rate = counter_rate(data, role)
    method = f"counter of {teeth} teeth read at intervals, radius {radius:g} m"
    return AxleSpeed(axle, (rate.scaled(2 * np.pi * radius / teeth),), method, None, radius)


def counter_rate(data: Aligned, role: str) -> Samples:
    """Teeth in a second of a sampled counter, wheel geometry unknown."""
    channel = data.recording.channels[role]
    source = data.recording.roles.roles.get(role)
    modulo = source.modulo if source and source.modulo else WRAP
    return teeth_per_second(data.time[role], channel.value, modulo, origin=channel.origin)


def _wheel(data: Aligned, axle: str, role: str) -> tuple[int, float] | str:
    """Teeth in a turn and rolling radius, or what the role map lacks."""
    vehicle = data.recording.roles.vehicle
    source = data.recording.roles.roles.get(role)
    of_axle = vehicle.rear_radius if axle == "rear" else vehicle.front_radius
    radius = source.radius if source and source.radius else of_axle
    lacking = []
    if vehicle.teeth_per_turn is None:
        lacking.append("vehicle.teeth_per_turn")
    if radius is None:
        lacking.append(f"vehicle.{axle}_radius")
    if vehicle.teeth_per_turn is None or radius is None:
        return f"{role} cannot become m/s: the role map does not give {' and '.join(lacking)}"
    return vehicle.teeth_per_turn, radius
