"""Variables of an FMU that its TOML file names, with validation and unit conversion."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from slipbench.identification.mismatch.callables.fmu.elements import (
    Element,
    array_named,
    elements,
    found_element,
    names,
    shape_of,
    start_numbers,
)
from slipbench.identification.mismatch.callables.fmu.kinds import KINDS, REAL, Kind, kind_of
from slipbench.identification.mismatch.callables.fmu.units import conversion
from slipbench.plant.errors import nearest
from slipbench.protocol.errors import InputError


@dataclass(frozen=True)
class Port:
    """A number of the FMU: value in the FMU = slope * value in the file's unit + offset.

    low, high: bounds of the FMU, in the file's unit. kind: its type. starts: start values of all
    elements of its variable, in the FMU's unit; index: its element. discrete: whether it changes at
    events only.
    """

    name: str
    reference: int
    slope: float
    offset: float
    low: float = -math.inf
    high: float = math.inf
    kind: Kind = REAL
    starts: tuple[float, ...] = (0.0,)
    index: int = 0
    discrete: bool = False

    @property
    def start(self) -> float:
        """Start value in the file's unit."""
        return (self.starts[self.index] - self.offset) / self.slope


@dataclass(frozen=True)
class StatePort:
    """A continuous state. index: its position among the states of the FMU."""

    port: Port
    index: int


def state_port(description: Any, name: str, variable: str, unit: str, where: str) -> StatePort:
    """Return a continuous state of an FMU. Raises InputError.

    name: in the TOML file; unit: of its values there.
    """
    states = list(
        names(
            unknown.variable.derivative
            for unknown in description.derivatives
            if unknown.variable.derivative is not None
        )
    )
    variable_name = variable or name
    if variable_name not in states:
        raise InputError(
            f"the FMU has no continuous state {variable_name!r}",
            where=where,
            expected=", ".join(states) or "an FMU with continuous states",
            remedy=nearest(variable_name, states) if states else "",
        )
    return StatePort(
        port(description, name, variable_name, unit, "output", where), states.index(variable_name)
    )


def port(description: Any, name: str, variable: str, unit: str, suits: str, where: str) -> Port:
    """Return a number of an FMU. suits: required use, "parameter", "input" or "output".

    name: in the TOML file; unit: of its values there; variable: name in the FMU, empty: the same.
    Raises InputError.
    """
    known = {v.name: v for v in description.modelVariables}
    element = _element(description, known, variable or name, suits, where)
    found = element.variable
    kind = _kind(description, element, where)
    if not SUITS[suits](found):
        raise InputError(
            f"{element.name!r} cannot be used as {suits}",
            where=where,
            expected=EXPECTED[suits],
            found=f"causality {found.causality}, variability {found.variability}",
            remedy=_structural_remedy(found) or nearest(element.name, numbers(description, suits)),
        )
    slope, offset = conversion(description, found, unit, where)
    low, high = sorted(
        (end - offset) / slope
        for end in (_number(found.min, -math.inf), _number(found.max, math.inf))
    )
    return Port(
        name,
        int(found.valueReference),
        slope,
        offset,
        low,
        high,
        kind,
        start_numbers(found),
        element.index,
        kind.whole or found.variability == "discrete",
    )


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


def is_number(description: Any, variable: Any) -> bool:
    """Return whether a variable is numeric and not clocked."""
    kind = kind_of(str(description.fmiVersion), variable.type)
    return kind is not None and not variable.clocks


def suited(description: Any, suits: str) -> list[Element]:
    """Return the elements of an FMU that can be used as "parameter", "input" or "output"."""
    return [
        element
        for variable in description.modelVariables
        if is_number(description, variable) and SUITS[suits](variable)
        for element in elements(variable)
    ]


def numbers(description: Any, suits: str) -> list[str]:
    """Return the names of the usable elements; of all variables where there are none."""
    found = [element.name for element in suited(description, suits)]
    return found or [v.name for v in description.modelVariables]


def _element(description: Any, known: dict[str, Any], name: str, suits: str, where: str) -> Element:
    element = found_element(known, name)
    if element is not None:
        return element
    array = array_named(known, name)
    if array is not None:
        first = ",".join("1" for _ in shape_of(array))
        raise InputError(
            f"{name!r} names no element of the array {array.name!r}",
            where=where,
            expected=f"{array.name}[{first}] to {array.name}[{','.join(map(str, shape_of(array)))}]",
            found=name,
            remedy="bind each element by itself; indices count from 1",
        )
    raise InputError(
        f"the FMU has no variable {name!r}",
        where=where,
        remedy=nearest(name, numbers(description, suits)),
    )


def _kind(description: Any, element: Element, where: str) -> Kind:
    """Return the type of an element. Raises InputError where it is not numeric, or clocked."""
    version, variable = str(description.fmiVersion), element.variable
    kind = kind_of(version, variable.type)
    if kind is None:
        raise InputError(
            f"{variable.name!r} is not a number",
            where=where,
            expected=f"a variable of type {', '.join(KINDS[version[:3]])}",
            found=str(variable.type),
            remedy="leave it out: it keeps its start value",
        )
    if variable.clocks:
        raise InputError(
            f"{variable.name!r} has a value only when a clock ticks",
            where=where,
            expected="a variable without clocks",
            found=f"clocks {', '.join(clock.name for clock in variable.clocks)}",
            remedy="take a variable that holds the value between ticks",
        )
    return kind


def _structural_remedy(variable: Any) -> str:
    if variable.causality != "structuralParameter":
        return ""
    return "it changes the structure of the FMU; take a parameter that does not"


def _number(text: str | None, otherwise: float) -> float:
    try:
        return otherwise if text is None else float(text)
    except ValueError:
        return otherwise
