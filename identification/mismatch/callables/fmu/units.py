"""Units of an FMU and of the file beside it, converted into each other."""

import re
from contextlib import suppress
from typing import Any

from slipbench.protocol.errors import InputError
from slipbench.protocol.units import linear, to_base

BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


def conversion(description: Any, variable: Any, unit: str, where: str) -> tuple[float, float]:
    """Return slope and offset from a unit to that of the FMU; 1 and 0 where the FMU has none.

    Raises InputError where the two measure different things.
    """
    own = variable.unit or getattr(variable.declaredType, "unit", None)
    if not own:
        return 1.0, 0.0
    base = _base_unit(description, own)
    try:
        return linear(unit, pint_name(own))
    except ValueError as unknown:
        if base is None:
            raise _contradiction(variable.name, unit, own, where) from unknown
    name, factor, offset = base
    try:
        slope, shift = linear(unit, name)
    except ValueError as fault:
        raise _contradiction(variable.name, unit, own, where) from fault
    return slope / factor, (shift - offset) / factor


def _contradiction(name: str, unit: str, own: str, where: str) -> InputError:
    return InputError(
        f"the units of {name!r} contradict each other",
        where=where,
        expected=f"a unit that converts to {own!r}, that of the FMU",
        found=repr(unit),
        remedy="correct the unit in the file beside the FMU",
    )


def pint_name(unit: str) -> str:
    """Return a unit of Modelica ("N.m/rad", "kg.m2", "m/s2") as pint writes it."""
    powers = re.sub(r"(?<=[A-Za-z])(-?\d)", r"**\1", unit)
    return re.sub(r"(?<=[\w)])\.(?=[A-Za-z(])", "*", powers)


def _base_unit(description: Any, unit: str) -> tuple[str, float, float] | None:
    """Return the base unit that the FMU declares for a unit, factor and offset; None: none.

    value in the base unit = factor * value in the unit + offset
    """
    for told in description.unitDefinitions:
        if told.name == unit and told.baseUnit is not None:
            powers = [(name, int(getattr(told.baseUnit, name))) for name in BASE]
            text = "*".join(f"{name}**{power}" for name, power in powers if power) or "1"
            with suppress(ValueError):
                to_base(text)
                return text, float(told.baseUnit.factor), float(told.baseUnit.offset)
    return None
