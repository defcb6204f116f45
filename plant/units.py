"""A number with a unit becomes a number in SI, once, when the file is read."""

from functools import cache
from typing import Any

import pint

ANGULAR = ("rad/s",)


@cache
def _registry() -> Any:
    return pint.UnitRegistry()


def to_si(value: float, unit: str, si: str) -> float:
    """Return the value in the SI unit. Raises ValueError, in words, where that has no meaning.

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
    except (pint.UndefinedUnitError, pint.DefinitionSyntaxError) as unknown:
        raise ValueError(f"a unit that can become {si}, not '{unit}' (unknown)") from unknown
    except pint.DimensionalityError as wrong:
        raise ValueError(f"a unit that can become {si}, not '{unit}'") from wrong


def _parsed(unit: str) -> Any:
    return _registry().Unit("" if unit == "1" else unit.replace("%", "percent"))
