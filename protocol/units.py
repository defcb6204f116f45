"""Units are converted once, at the edge: inside, everything is SI (angles rad, ratios 1)."""

import math
import re
from collections.abc import Mapping
from fractions import Fraction
from functools import cache, lru_cache
from pathlib import Path
from tokenize import TokenError

import pint

from slipbench.protocol.errors import InputError, readable
from slipbench.protocol.unit_spellings import spelled

DEFINITIONS = Path(__file__).with_name("units.txt")
NAMED = {"kg/m/s**2": "Pa", "kg*m/s**2": "N", "kg*m**2/s**2": "N m", "m/s**2": "m/s^2"}
"""Base units that have a name of their own."""
Powers = Mapping[str, Fraction]
"""Powers of base units, none of them 0."""
BASE_UNITS = {
    "[length]": {"m": 1},
    "[mass]": {"kg": 1},
    "[time]": {"s": 1},
    "[current]": {"kg": 1, "m": 2, "s": -3, "V": -1},
    "[temperature]": {"K": 1},
    "[substance]": {"mol": 1},
    "[luminosity]": {"cd": 1},
}
"""Volts in the place of amperes: sensors report volts."""


# pint calculates what it is given: "9**9**9 m" would keep it for hours and fill the memory.
_PLAIN = re.compile(r"[\w\s/*^().%°·µΩ²³-]{0,60}")
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?(?=\s|$|[^\W\d_]|[%°])")
_POWER = re.compile(r"(?<=[\w°Ω])\s*(?:\*\*|\^)\s*-?\d(?:\.5)?(?![\w.]|\s*(?:\*\*|\^))")
# What pint, and the Python tokenizer inside it, raise for text that is no unit.
_NO_UNIT = (
    pint.PintError,
    ArithmeticError,
    AssertionError,
    AttributeError,
    LookupError,
    RecursionError,
    SyntaxError,
    TokenError,
    TypeError,
    ValueError,
)


@cache
def _registry() -> pint.UnitRegistry[float]:
    known: pint.UnitRegistry[float]
    known = pint.UnitRegistry(autoconvert_offset_to_baseunit=True, on_redefinition="ignore")
    known.load_definitions(DEFINITIONS)
    return known


@lru_cache(maxsize=1024)
def linear(unit: str, to: str) -> tuple[float, float]:
    """Slope and offset with ``value_in_to = slope * value_in_unit + offset``.

    Raises ValueError where the units are unknown or measure different things.
    """
    unit_name, to_name = spelled(unit), spelled(to)
    if unit_name == "g" and to_name in ("m/s^2", "m/s**2"):
        unit_name = "standard_gravity"  # an accelerometer's g, not a gram
    try:
        source = _registry()
        _check_plain(unit_name)
        zero, one, two = (
            float(source.Quantity(value, unit_name).to(to_name).magnitude)
            for value in (0.0, 1.0, 2.0)
        )
    except _NO_UNIT as cause:
        raise ValueError(f"unit {unit!r} does not convert to {to!r} ({cause})") from cause
    if not math.isclose(two - one, one - zero, rel_tol=1e-6):
        raise ValueError(f"unit {unit!r} does not convert to {to!r} (it is logarithmic)")
    return one - zero, zero


def is_unit(text: str) -> bool:
    """Whether a text is a unit that is known here."""
    return converts(text, text)


def converts(unit: str, to: str) -> bool:
    """Whether values in `unit` convert to `to`."""
    try:
        linear(unit, to)
    except ValueError:
        return False
    return True


@lru_cache(maxsize=1024)
def powers_of(unit: str) -> Powers:
    """Return the powers of m, kg, s, V, K, mol and cd in a unit; angles and ratios have none.

    Raises ValueError where the unit is unknown.
    """
    _check_plain(spelled(unit))
    try:
        found = dict(_registry().Quantity(1.0, spelled(unit)).dimensionality)
    except _NO_UNIT as cause:
        raise ValueError(f"unit {unit!r} is unknown ({cause})") from cause
    powers: dict[str, Fraction] = {}
    for name, power in found.items():
        share = Fraction(str(power)).limit_denominator(1000)
        for base, each in BASE_UNITS.get(name, {name: 1}).items():
            powers[base] = powers.get(base, Fraction(0)) + each * share
    return {base: power for base, power in powers.items() if power}


@lru_cache(maxsize=1024)
def to_base(unit: str) -> tuple[float, float, str]:
    """Slope and offset to the base units of SI, and those; `unit` itself where it is one already.

    Raises ValueError where the unit is unknown.
    """
    source = _registry()
    _check_plain(spelled(unit))
    try:
        base = f"{source.Quantity(1.0, spelled(unit)).to_base_units().units:~C}"
    except _NO_UNIT as cause:
        raise ValueError(f"unit {unit!r} is not known ({cause})") from cause
    slope, offset = linear(unit, base)
    same = slope == 1.0 and offset == 0.0
    return slope, offset, (unit or "1") if same else NAMED.get(base, base or "1")


def _check_plain(unit: str) -> None:
    """Reject a text that is not a product of units with powers of one digit."""
    remainder = _POWER.sub("", unit)
    if not _PLAIN.fullmatch(unit) or "^" in remainder or "**" in remainder:
        raise ValueError(f"{unit[:60]!r} is no unit")


def number_and_unit(text: str) -> tuple[str, str]:
    """Split a text such as ``"14000 rpm"`` or ``"900m"``; the space may be missing."""
    text = text.strip()
    if found := _NUMBER.match(text):
        return found.group(), text[found.end() :].strip()
    number, _, unit = text.partition(" ")
    return number, unit.strip()


def parse_quantity(text: str | float | int, to: str) -> float:
    """Value of a text such as ``"14000 rpm"`` in the unit `to`; a number without unit is in `to`.

    Raises InputError where the text is no quantity of that unit.
    """
    if isinstance(text, (int, float)):
        return float(text)
    number, unit = number_and_unit(text)
    try:
        magnitude = float(number)
        slope, offset = linear(unit, to)
    except ValueError as cause:
        raise InputError(
            f"{readable(repr(text), 80)} is not a quantity",
            expected=f"a number and a unit that converts to {to or 'a pure number'}",
            found=str(cause),
            remedy='write it as in "14000 rpm", "4 %" or "20 ms"',
        ) from cause
    return slope * magnitude + offset
