"""Variables of an FMU that the file beside it names: found, of the right kind, units converted."""

import math
import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

from slipbench.plant.errors import nearest
from slipbench.protocol.errors import InputError
from slipbench.protocol.units import linear, to_base

REAL = ("Real", "Float64")
BASE = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")


@dataclass(frozen=True)
class Port:
    """A variable: value in the FMU = slope * value in the file's unit + offset.

    low, high: of the FMU, in the file's unit.
    """

    name: str
    reference: int
    slope: float
    offset: float
    low: float = -math.inf
    high: float = math.inf


@dataclass(frozen=True)
class StatePort:
    """A continuous state. index: its place among the states of the FMU."""

    port: Port
    index: int


def state_port(description: Any, name: str, variable: str, unit: str, where: str) -> StatePort:
    """Return a continuous state of an FMU, in the order of its derivatives. Raises InputError.

    name: in the file; unit: of its values there.
    """
    states = [
        unknown.variable.derivative.name
        for unknown in description.derivatives
        if unknown.variable.derivative is not None
    ]
    own = variable or name
    if own not in states:
        raise InputError(
            f"the FMU has no continuous state {own!r}",
            where=where,
            expected=", ".join(states) or "an FMU with continuous states",
            remedy=nearest(own, states) if states else "",
        )
    return StatePort(port(description, name, own, unit, "output", where), states.index(own))


def port(description: Any, name: str, variable: str, unit: str, suits: str, where: str) -> Port:
    """Return a variable of an FMU. suits: "parameter", "input" or "output".

    name: in the file; unit: of its values there. Raises InputError.
    """
    known = {v.name: v for v in description.modelVariables}
    own = variable or name
    if own not in known:
        raise InputError(
            f"the FMU has no variable {own!r}",
            where=where,
            remedy=nearest(own, _of_kind(known, suits)),
        )
    found = known[own]
    _check_type(found, where)
    if not SUITS[suits](found):
        raise InputError(
            f"{own!r} cannot be used as {suits}",
            where=where,
            expected=EXPECTED[suits],
            found=f"causality {found.causality}, variability {found.variability}",
            remedy=_structural(found) or nearest(own, _of_kind(known, suits)),
        )
    slope, offset = conversion(description, found, unit, where)
    ends = sorted(
        (end - offset) / slope
        for end in (_number(found.min, -math.inf), _number(found.max, math.inf))
    )
    return Port(name, int(found.valueReference), slope, offset, *ends)


def _settable(variable: Any) -> bool:
    if variable.causality == "structuralParameter" or variable.variability == "constant":
        return False
    return variable.causality == "parameter" or variable.initial in ("exact", "approx")


SUITS: dict[str, Callable[[Any], bool]] = {
    "parameter": _settable,
    "input": lambda v: v.causality == "input",
    "output": lambda v: v.causality != "independent",
}
EXPECTED = {
    "parameter": "a parameter, or a variable whose start value can be set",
    "input": "causality input",
    "output": "a variable that changes with time",
}


def is_array(variable: Any) -> bool:
    """Whether a variable holds more than one number."""
    return bool(variable.dimensions or variable.shape)


def is_real(variable: Any) -> bool:
    """Whether a variable holds one real number."""
    return variable.type in REAL and not is_array(variable)


def _of_kind(known: dict[str, Any], suits: str) -> list[str]:
    return [n for n, v in known.items() if is_real(v) and SUITS[suits](v)] or [*known]


def _structural(variable: Any) -> str:
    if variable.causality != "structuralParameter":
        return ""
    return "it changes the structure of the FMU; take a parameter that does not"


def _check_type(variable: Any, where: str) -> None:
    if not is_real(variable):
        kind = "an array" if is_array(variable) else variable.type
        raise InputError(
            f"{variable.name!r} is not a real number",
            where=where,
            expected=f"a scalar variable of type {' or '.join(REAL)}",
            found=kind,
        )


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


def _number(text: str | None, otherwise: float) -> float:
    try:
        return otherwise if text is None else float(text)
    except ValueError:
        return otherwise
