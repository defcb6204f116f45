"""Names, units and numbers as a report shows them."""

import numpy as np

from slipbench.identification.response.response import FrequencyResponse
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.unit_spellings import spelled
from slipbench.protocol.units import to_base

_SHOWN = {
    "1": (100.0, 0.0, "%"),
    "rad": (180 / np.pi, 0.0, "°"),
    "rad/s": (30 / np.pi, 0.0, "rpm"),
    "m/s": (3.6, 0.0, "km/h"),
    "m": (1e3, 0.0, "mm"),
    "K": (1.0, -273.15, "°C"),
    "Pa": (1e-5, 0.0, "bar"),
}
_LETTERS = {"degC": "°C", "degF": "°F", "deg": "°", "percent": "%", "dimensionless": "1"}
"""Display names of stated units, by their spelling in `unit_spellings`."""
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


def unit(si: str, stated: str = "") -> str:
    """Display unit of a quantity: the one that its source states, else %, °, rpm, km/h, mm, °C, bar.

    si: its SI unit; stated: as in "degC", empty where its source states none.
    """
    return _display(si, stated)[2]


def shown(value: FloatArray, si: str, stated: str = "") -> FloatArray:
    """Values in the display unit. value: in the unit `si`, any shape; the same shape is returned."""
    factor, offset, _ = _display(si, stated)
    return value * factor + offset


def shown_deviation(value: float, si: str, stated: str = "") -> str:
    """A difference of two values with its display unit. value: in the unit `si`."""
    factor, _, each = _display(si, stated)
    return f"{value * factor:.3g} {each}".removesuffix(" 1")


def axis(text: str, unit: str) -> str:
    """Title of an axis: a name and its unit, the name alone for a pure number."""
    return text if unit == "1" else f"{text} / {unit}"


def gain_axis(unit: str) -> str:
    """Title of an axis of gain in `unit`; without it for a ratio of equal units."""
    return "gain" if unit == "1" else f"gain / ({unit})"


def decibel_axis(unit: str) -> str:
    """Title of an axis of gain in dB, relative to one `unit`."""
    return "gain / dB" if unit == "1" else f"gain / dB (re 1 {unit})"


def _display(si: str, stated: str) -> tuple[float, float, str]:
    """Factor, offset and name of the display unit: shown = factor * SI + offset."""
    if not stated:
        return _SHOWN.get(si, (1.0, 0.0, si))
    slope, offset, _ = to_base(stated)
    return 1 / slope, -offset / slope, _LETTERS.get(spelled(stated), stated)


def p_value(probability: float) -> str:
    """Probability of a test, such as "p = 0.03"; below 0.001 only that it is."""
    return f"p = {probability:.2g}" if probability >= 1e-3 else "p < 0.001"


def gain_unit(under: str, over: str, stated: tuple[str, str] = ("", "")) -> tuple[float, str]:
    """Factor from SI and display unit of a gain, such as percent slip per percent throttle.

    under, over: SI units of input and output; stated: the units that their sources state.
    """
    (below, _, each), (above, _, top) = _display(under, stated[0]), _display(over, stated[1])
    return above / below, top if each == "1" else f"{top}\u2009/\u2009{each}"


def response_unit(of: FrequencyResponse) -> tuple[float, str]:
    """Factor from SI and display unit of the gain of a response."""
    return gain_unit(*of.si_units, of.stated)


def decibel(ratio: float) -> float:
    """Amplitude ratio in dB: 20 log10(ratio)."""
    return float(20 * np.log10(ratio))


def time_unit(seconds: float) -> tuple[float, str]:
    """Factor from s and display unit of a time: ms below 1 s, else s."""
    return (1e3, "ms") if abs(seconds) < 1.0 else (1.0, "s")


def time_in_words(seconds: float) -> str:
    """Time as text in ms or s, three significant digits."""
    factor, each = time_unit(seconds)
    return f"{seconds * factor:.3g} {each}"


def with_interval(value: float, half_width: float) -> str:
    """Value and half width of its interval as text, to two significant digits of the half width."""
    if not 0.0 < half_width < float("inf"):
        return f"{value:.3g}"
    decimals = min(max(1 - int(np.floor(np.log10(half_width))), 0), 12)
    return f"{value:.{decimals}f} ± {half_width:.{decimals}f}"


def listed(parts: list[str]) -> str:
    """Enumeration as text: 'a, b and c'."""
    if len(parts) < 2:
        return "".join(parts)
    return f"{', '.join(parts[:-1])} and {parts[-1]}"
