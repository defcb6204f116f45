"""Quantities as people read them: units, roles and numbers in words."""

import numpy as np

from slipbench.protocol.recording.channel import FloatArray

_SHOWN = {
    "1": (100.0, 0.0, "%"),
    "rad": (180 / np.pi, 0.0, "°"),
    "rad/s": (30 / np.pi, 0.0, "rpm"),
    "m/s": (3.6, 0.0, "km/h"),
    "m": (1e3, 0.0, "mm"),
    "K": (1.0, -273.15, "°C"),
    "Pa": (1e-5, 0.0, "bar"),
}
_NAMES = {
    "throttle_command": "throttle commanded",
    "throttle_position": "throttle measured",
    "spark_command": "spark offset commanded",
    "spark_advance": "spark advance applied",
    "engine_speed": "engine speed",
    "slip": "slip",
    "rear_wheel_speed": "rear wheel speed, before the filters",
    "front_wheel_speed": "front wheel speed, before the filters",
    "rear_suspension_travel": "rear suspension travel",
    "front_suspension_travel": "front suspension travel",
}


def name(role: str) -> str:
    """Call a role by its name for people."""
    return _NAMES.get(role, role.replace("_", " "))


def unit(si: str) -> str:
    """Name the unit in which people read a quantity given in `si`."""
    return _SHOWN.get(si, (1.0, 0.0, si))[2]


def shown(value: FloatArray, si: str) -> FloatArray:
    """Turn SI values into the unit that people read."""
    factor, offset, _ = _SHOWN.get(si, (1.0, 0.0, si))
    return value * factor + offset


def swing(value: FloatArray, si: str) -> FloatArray:
    """Turn an amplitude or a difference into the unit that people read."""
    return value * _SHOWN.get(si, (1.0, 0.0, si))[0]


def of_role(role: str) -> str:
    """Give the SI unit of an input, of slip or of the engine speed."""
    if role.startswith("spark"):
        return "rad"
    return "rad/s" if role == "engine_speed" else "1"


def gain_unit(input_role: str, output_role: str) -> tuple[float, str]:
    """Factor and unit in which a gain is read: percent slip per percent throttle, or per degree."""
    over, under = of_role(output_role), of_role(input_role)
    factor = _SHOWN[over][0] / _SHOWN[under][0]
    return factor, f"{_SHOWN[over][2]}\u2009/\u2009{_SHOWN[under][2]}"


def decibel(ratio: float) -> float:
    """Twenty times the logarithm."""
    return float(20 * np.log10(ratio))


def milliseconds(seconds: float) -> str:
    """Give a short time in ms with three significant digits."""
    return f"{seconds * 1e3:.3g} ms"


def listed(parts: list[str]) -> str:
    """Join words as a sentence does."""
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} and {parts[-1]}"
