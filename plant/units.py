"""A number with a unit becomes a number in SI, once, when the file is read."""

import re
from functools import cache
from tokenize import TokenError
from typing import Any

import pint

ANGULAR = ("rad/s",)
NEWTON_METRE = re.compile(r"(?<![A-Za-z])Nm(?![A-Za-z])")
"""As engineers write it; to pint the number of a yarn."""
# pint calculates what it is given: "9**9**9 m" would keep it for hours and fill the memory.
_PLAIN = re.compile(r"[\w\s/*^().%°·µΩ²³-]{0,60}")
_POWER = re.compile(r"(?<=[\w°Ω])\s*(?:\*\*|\^)\s*-?\d(?![\w.]|\s*(?:\*\*|\^))")


@cache
def _registry() -> Any:
    return pint.UnitRegistry()


def to_si(value: float, unit: str, si: str) -> float:
    """The value in the SI unit. Raises ValueError, in words, where that has no meaning.

    Hz is refused for an angular speed: pint takes both for 1/s, so that 12 Hz would silently become
    12 rad/s. Write turn/s, rpm or rad/s.
    """
    if si in ANGULAR and ("Hz" in unit or "hertz" in unit.lower()):
        raise ValueError(f"an angular speed in turn/s, rpm or rad/s, not in {unit}")
    try:
        source, target = _parsed(unit), _parsed(si)
        if source == target:
            return float(value)
        return float(_registry().Quantity(value, source).to(target).magnitude)
    except (
        pint.UndefinedUnitError,
        pint.DefinitionSyntaxError,
        ArithmeticError,
        AssertionError,
        AttributeError,
        LookupError,
        RecursionError,
        SyntaxError,
        TokenError,
        TypeError,
    ) as unknown:
        raise ValueError(f"a unit that can become {si}, not '{unit}' (unknown)") from unknown
    except pint.DimensionalityError as wrong:
        raise ValueError(f"a unit that can become {si}, not '{unit}'") from wrong


def _parsed(unit: str) -> Any:
    rest = _POWER.sub("", unit)
    if not _PLAIN.fullmatch(unit) or "^" in rest or "**" in rest:
        raise pint.DefinitionSyntaxError("not a product of units with powers of one digit")
    known = NEWTON_METRE.sub("(N m)", unit).replace("%", "percent")
    return _registry().Unit("" if unit == "1" else known)


def base_exponents(unit: str) -> dict[str, int]:
    """Exponents of the base units, by pint's names, of a unit in SI; radians are kept."""
    base = _registry().Quantity(1.0, _parsed(unit)).to_base_units()
    return {name: int(power) for name, power in base.unit_items()}
