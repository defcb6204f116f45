"""Numbers of an FMU by name: scalar variables, and elements of arrays as `x[1]` and `A[2,3]`.

Indices count from 1; the last index varies fastest, as in Modelica and FMI variable naming.
"""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

ELEMENT = re.compile(r"(?P<name>.+)\[(?P<indices>\d+(,\d+)*)\]")
TRUE = {"true": 1.0, "false": 0.0}


@dataclass(frozen=True)
class Element:
    """A number of a variable. index: flat position in the array, from 0; 0 for a scalar."""

    variable: Any
    index: int = 0

    @property
    def name(self) -> str:
        """Name with indices, as `A[2,3]`."""
        shape = shape_of(self.variable)
        if not shape:
            return str(self.variable.name)
        return _name(self.variable, tuple(int(i) for i in np.unravel_index(self.index, shape)))

    @property
    def start(self) -> str | None:
        """Start value as written; None where it has none."""
        written = starts_of(self.variable)
        return written[self.index] if written else None


def shape_of(variable: Any) -> tuple[int, ...]:
    """Return the dimensions of an array for the start values of its size parameters; (): scalar."""
    return tuple(variable.shape or ())


def is_array(variable: Any) -> bool:
    """Return whether a variable is an array, even of one number."""
    return bool(variable.dimensions or variable.shape)


def count(variable: Any) -> int:
    """Return the number of elements of a variable."""
    return int(np.prod(shape_of(variable), dtype=int))


def elements(variable: Any) -> list[Element]:
    """Return all numbers of a variable, in the order in which FMI passes them."""
    return [Element(variable, k) for k in range(count(variable))]


def found_element(known: dict[str, Any], name: str) -> Element | None:
    """Return the element with a name; None where there is none, or for an array without indices.

    known: variables by name.
    """
    if name in known:
        return None if is_array(known[name]) else Element(known[name])
    match = ELEMENT.fullmatch(name)
    variable = known.get(match["name"]) if match else None
    if match is None or variable is None:
        return None
    indices, shape = [int(i) for i in match["indices"].split(",")], shape_of(variable)
    if len(indices) != len(shape) or not all(
        1 <= i <= length for i, length in zip(indices, shape, strict=True)
    ):
        return None
    return Element(variable, int(np.ravel_multi_index([i - 1 for i in indices], shape)))


def array_named(known: dict[str, Any], name: str) -> Any | None:
    """Return the array with a name, with or without indices; None where there is none."""
    match = ELEMENT.fullmatch(name)
    variable = known.get(name) or (known.get(match["name"]) if match else None)
    return variable if variable is not None and is_array(variable) else None


def names(variables: Iterable[Any]) -> Iterator[str]:
    """Yield the names of all numbers of variables."""
    for variable in variables:
        for indices in product(*map(range, shape_of(variable))):
            yield _name(variable, indices) if is_array(variable) else str(variable.name)


def starts_of(variable: Any) -> list[str]:
    """Return the start values of all numbers of a variable as written; empty where it has none.

    One start value may apply to all elements of an array.
    """
    written = variable.start
    if written is None:
        return []
    values = [str(one) for one in written] if isinstance(written, list) else str(written).split()
    return values * count(variable) if len(values) == 1 else values


def start_numbers(variable: Any) -> tuple[float, ...]:
    """Return the start values of all numbers of a variable; 0 where it has none."""
    values = [_number(one) for one in starts_of(variable)]
    return tuple(values) if len(values) == count(variable) else (0.0,) * count(variable)


def _number(written: str) -> float:
    known = TRUE.get(written.lower())
    if known is not None:
        return known
    try:
        return float(written)
    except ValueError:
        return 0.0


def _name(variable: Any, indices: tuple[int, ...]) -> str:
    return f"{variable.name}[{','.join(str(i + 1) for i in indices)}]"
