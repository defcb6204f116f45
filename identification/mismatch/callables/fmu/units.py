"""Conversion between units of an FMU and of its TOML file."""

import re
from contextlib import suppress
from typing import Any

from slipbench.protocol.errors import InputError
from slipbench.protocol.units import linear, to_base

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


def conversion(description: Any, variable: Any, unit: str, where: str) -> tuple[float, float]:
    """Return slope and offset from a unit to that of the FMU; 1 and 0 where the FMU has none.

    Raises InputError where the two have different dimensions.
    """
    fmu_unit = variable.unit or getattr(variable.declaredType, "unit", None)
    if not fmu_unit:
        return 1.0, 0.0
    base = _base_unit(description, fmu_unit)
    try:
        return linear(unit, pint_name(fmu_unit))
    except ValueError as unknown:
        if base is None:
            raise _contradiction(variable.name, unit, fmu_unit, where) from unknown
    name, factor, offset = base
    try:
        slope, shift = linear(unit, name)
    except ValueError as fault:
        raise _contradiction(variable.name, unit, fmu_unit, where) from fault
    return slope / factor, (shift - offset) / factor


def _contradiction(name: str, unit: str, fmu_unit: str, where: str) -> InputError:
    return InputError(
        f"the units of {name!r} contradict each other",
        where=where,
        expected=f"a unit that converts to {fmu_unit!r}, that of the FMU",
        found=repr(unit),
        remedy="correct the unit in the file beside the FMU",
    )


def pint_name(unit: str) -> str:
    """Return a unit of Modelica ("N.m/rad", "kg.m2", "m/s2") in the notation of pint."""
    powers = re.sub(r"(?<=[A-Za-z])(-?\d)", r"**\1", unit)
    return re.sub(r"(?<=[\w)])\.(?=[A-Za-z(])", "*", powers)


def _base_unit(description: Any, unit: str) -> tuple[str, float, float] | None:
    """Return base unit, factor and offset that the FMU declares for a unit; None without them.

    value in the base unit = factor * value in the unit + offset
    """
    for definition in description.unitDefinitions:
        if definition.name == unit and definition.baseUnit is not None:
            powers = [(name, int(getattr(definition.baseUnit, name))) for name in BASE]
            text = "*".join(f"{name}**{power}" for name, power in powers if power) or "1"
            with suppress(ValueError):
                to_base(text)
                return text, float(definition.baseUnit.factor), float(definition.baseUnit.offset)
    return None
