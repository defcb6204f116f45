"""Names, units and numbers as a report shows them."""

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
    "throttle_command": "throttle command",
    "throttle_position": "throttle position",
    "spark_command": "spark offset command",
    "spark_advance": "applied spark advance",
    "engine_speed": "engine speed",
    "slip": "slip",
    "rear_wheel_speed": "rear wheel speed, unfiltered",
    "front_wheel_speed": "front wheel speed, unfiltered",
    "rear_suspension_travel": "rear suspension travel",
    "front_suspension_travel": "front suspension travel",
}


def name(role: str) -> str:
    """Display name of a role."""
    return _NAMES.get(role, role.replace("_", " "))


def unit(si: str) -> str:
    """Display unit of a quantity whose SI unit is `si`: %, °, rpm, km/h, mm, °C, bar."""
    return _SHOWN.get(si, (1.0, 0.0, si))[2]


def shown(value: FloatArray, si: str) -> FloatArray:
    """Values in the display unit. value: in the unit `si`, any shape; the same shape is returned."""
    factor, offset, _ = _SHOWN.get(si, (1.0, 0.0, si))
    return value * factor + offset


def shown_deviation(value: float, si: str) -> str:
    """A difference of two values with its display unit. value: in the unit `si`."""
    factor = _SHOWN.get(si, (1.0, 0.0, si))[0]
    return f"{value * factor:.3g} {unit(si)}"


def p_value(probability: float) -> str:
    """Probability of a test, such as "p = 0.03"; below 0.001 only that it is."""
    return f"p = {probability:.2g}" if probability >= 1e-3 else "p < 0.001"


def gain_unit(under: str, over: str) -> tuple[float, str]:
    """Factor from SI and display unit of a gain, such as percent slip per percent throttle.

    under, over: SI units of input and output.
    """
    factors = [_SHOWN.get(si, (1.0, 0.0, si))[0] for si in (over, under)]
    return factors[0] / factors[1], f"{unit(over)}\u2009/\u2009{unit(under)}"


def decibel(ratio: float) -> float:
    """Amplitude ratio in dB: 20 log10(ratio)."""
    return float(20 * np.log10(ratio))


def milliseconds(seconds: float) -> str:
    """Time as text in ms, three significant digits. seconds: s."""
    return f"{seconds * 1e3:.3g} ms"


def listed(parts: list[str]) -> str:
    """Enumeration as text: 'a, b and c'."""
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} and {parts[-1]}"
