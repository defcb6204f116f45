"""Which unit makes the values of a column plausible for a role.

A stated unit is tested; where none is stated, every usual unit of that quantity is tested, and only
one that is plausible alone is proposed. A speed may also be compared with one whose unit is known.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slipbench.protocol.binding.behaviour import PLAUSIBLE, SPEED, SPEED_ROLES
from slipbench.protocol.binding.gear_ratios import correlation
from slipbench.protocol.binding.source_lines import PERCENT
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.role_proposal.columns import Column
from slipbench.protocol.tables.titles import unit_in_name
from slipbench.protocol.unit_spellings import spelled
from slipbench.protocol.units import converts, is_unit, linear

FloatArray = npt.NDArray[np.float64]

OUTSIDE = 0.02  # share of the values that may lie outside
SAME_MOTION = 0.95  # correlation of two speeds of one vehicle
AGREES_WITHIN = 0.15  # relative: a speedometer, a worn tyre, some slip
# Usual units by the SI unit of the role.
USUAL: Mapping[str, tuple[str, ...]] = {
    "m/s": ("km/h", "m/s", "mph"),
    "rad/s": ("deg/s", "rad/s"),
    "rad": ("deg", "rad"),
    "Pa": ("bar", "kPa", "psi", "mbar", "Pa"),
    "K": ("degC", "degF", "K"),
    "m/s^2": ("m/s^2", "standard_gravity"),
    "m": ("mm", "m"),
    "1": ("1", "%"),
    "A": ("A",),
    "s": ("s", "ms"),
    "count": ("count",),
}
# Size in SI that the largest value reaches in any drive, and does not exceed.
LARGEST: Mapping[str, tuple[float, float]] = {
    "engine_speed": (60.0, 2100.0),
    "vehicle_speed": (1.0, 130.0),
    "yaw_rate": (0.03, 7.0),
    "pitch_rate": (0.03, 7.0),
    "lean_angle": (0.03, 1.4),
    "steering_angle": (0.01, 20.0),
    "longitudinal_acceleration": (0.5, 25.0),
    "lateral_acceleration": (0.5, 25.0),
    "front_brake_pressure": (2e5, 3e7),
    "rear_brake_pressure": (1e5, 3e7),
    "manifold_pressure": (3e4, 5e5),
    "front_suspension_travel": (0.003, 0.6),
    "rear_suspension_travel": (0.003, 0.6),
}
SHARES = ("throttle_position", "throttle_command", "rider_grip", "brake", "clutch")
LIMITS: Mapping[str, tuple[float, float]] = {
    "coolant_temperature": (233.0, 410.0),
    "front_tyre_temperature": (233.0, 450.0),
    "rear_tyre_temperature": (233.0, 450.0),
    "latitude": (-np.pi / 2, np.pi / 2),
    "longitude": (-np.pi, np.pi),
    "course": (-2 * np.pi, 2 * np.pi),
    "altitude": (-500.0, 9000.0),
    "brake": (-0.1, 1.1),
    "clutch": (-0.1, 1.1),
    "gear": (-2.0, 15.0),
}


NO_LIMITS = (-np.inf, np.inf)


@dataclass(frozen=True)
class UnitVerdict:
    """Unit of a column in a role.

    unit       "" where none can be chosen
    stated     by the file, and it converts
    plausible  whether the values suit the role in that unit
    candidates units that are plausible, where none is stated
    reason     for people
    """

    unit: str
    stated: bool
    plausible: bool
    candidates: tuple[str, ...]
    reason: str


def unit_verdict(
    role: str, column: Column, reference: tuple[str, FloatArray, FloatArray] | None
) -> UnitVerdict:
    """Unit of a column in a role.

    reference: a speed whose unit is known: its name, its values in m/s and those of this column on the
    same times, (m,) each.
    """
    target, unit, value = ROLES[role].unit, column.unit, column.value
    source = "from its name" if unit == unit_in_name(column.name) else "stated"
    if unit and (target == "count" or converts(unit, target)):
        good = _in_range(role, unit, value)
        reason = f"unit {unit} {source}" + ("" if good else f", but {_range(role, unit, value)}")
        return UnitVerdict(unit, True, good, (), reason)
    if is_unit(unit) and spelled(unit) != "dimensionless":
        return _of_another_kind(role, unit)
    candidates = tuple(each for each in usual_units(role) if _is_plausible(role, each, value))
    why = f"the file states {unit!r}, which is no unit" if unit else "no unit stated"
    if target == "m/s" and reference is not None:
        found = _by_reference(candidates, *reference)
        if found is not None:
            return UnitVerdict(found[0], False, True, candidates, f"{why}; {found[1]}")
    if len(candidates) == 1:
        return UnitVerdict(
            candidates[0], False, True, candidates, f"{why}; only {candidates[0]} is plausible"
        )
    if candidates:
        listed = " or ".join(candidates)
        return UnitVerdict("", False, True, candidates, f"{why}; plausible in {listed}")
    return UnitVerdict("", False, False, (), f"{why}; plausible in no usual unit")


def needs_radius(role: str, unit: str) -> bool:
    """Whether a column is the angular speed of a wheel, whose role is a speed."""
    return role.endswith("wheel_speed") and converts(unit, "rad/s") and not converts(unit, "m/s")


def _of_another_kind(role: str, unit: str) -> UnitVerdict:
    """Verdict on a stated unit that measures something else: it is never replaced by another."""
    if needs_radius(role, unit):
        reason = f"unit {unit} stated: an angular speed, which needs the rolling radius"
        return UnitVerdict("", True, True, (unit,), reason)
    return UnitVerdict(
        "", True, False, (), f"the file states {unit}, which measures something else"
    )


def usual_units(role: str) -> tuple[str, ...]:
    """Units that a role is usually measured in."""
    target = ROLES[role].unit
    if target == "1" and role not in SHARES:
        return ("1",)
    return ("rpm", "rad/s") if role == "engine_speed" else USUAL[target]


def _by_reference(
    candidates: tuple[str, ...], name: str, speed: FloatArray, own: FloatArray
) -> tuple[str, str] | None:
    """Unit in which a speed agrees with one whose unit is known, and the reason."""
    agreed = correlation(own, speed)
    fast = speed > 0.3 * np.max(speed, initial=0.0)
    if agreed < SAME_MOTION or not fast.any():
        return None
    ratio = float(np.median(own[fast] / speed[fast]))
    for unit in candidates:
        relative = ratio * linear(unit, "m/s")[0]
        if abs(relative - 1) < AGREES_WITHIN:
            return unit, f"in {unit} it agrees with {name} (ratio {relative:.3f}, r {agreed:.3f})"
    return None


def _in_range(role: str, unit: str, value: FloatArray) -> bool:
    """Whether nearly all values are ones that the role can have."""
    slope, zero = _to(unit, ROLES[role].unit)
    si = slope * value + zero
    low, high = SPEED if role in SPEED_ROLES else LIMITS.get(role, PLAUSIBLE.get(role, NO_LIMITS))
    return float(np.mean((si < low) | (si > high))) <= OUTSIDE


def _is_plausible(role: str, unit: str, value: FloatArray) -> bool:
    """Whether values may be in an unstated unit: in range, and as large as in any drive."""
    if not _in_range(role, unit, value):
        return False
    if role in SHARES and unit == "%":
        return bool((value > PERCENT).any())
    slope, zero = _to(unit, ROLES[role].unit)
    size = float(np.percentile(np.abs(slope * value + zero), 99.5))
    least, most = LARGEST.get("vehicle_speed" if role in SPEED_ROLES else role, NO_LIMITS)
    return (least <= size or not np.ptp(value)) and size <= most


def _range(role: str, unit: str, value: FloatArray) -> str:
    slope, zero = _to(unit, ROLES[role].unit)
    ends = sorted((slope * float(value.min()) + zero, slope * float(value.max()) + zero))
    return f"{ends[0]:.4g} .. {ends[1]:.4g} {ROLES[role].unit} is not plausible"


def _to(unit: str, target: str) -> tuple[float, float]:
    return (1.0, 0.0) if target == "count" else linear(unit, target)
