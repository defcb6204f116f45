"""Numbers of an FMU by name: scalar variables, and elements of arrays as `x[1]` and `A[2,3]`.

Indices count from 1, the last one runs fastest, as Modelica and the naming convention of FMI have it.
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
    """A number of a variable. index: its place in the array, from 0; 0 of a scalar."""

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
        """Start value as written; None: it has none."""
        written = starts_of(self.variable)
        return written[self.index] if written else None


def shape_of(variable: Any) -> tuple[int, ...]:
    """Return the lengths of an array, with the start values of what sets them; (): a scalar."""
    return tuple(variable.shape or ())


def is_array(variable: Any) -> bool:
    """Whether a variable is an array, even of one number."""
    return bool(variable.dimensions or variable.shape)


def count(variable: Any) -> int:
    """Return how many numbers a variable holds."""
    return int(np.prod(shape_of(variable), dtype=int))


def elements(variable: Any) -> list[Element]:
    """Return all numbers of a variable, in the order in which FMI passes them."""
    return [Element(variable, k) for k in range(count(variable))]


def found_element(known: dict[str, Any], name: str) -> Element | None:
    """Return the number that a name means; None: there is none.

    known: variables by name. An array without indices is none.
    """
    if name in known:
        return None if is_array(known[name]) else Element(known[name])
    told = ELEMENT.fullmatch(name)
    variable = known.get(told["name"]) if told else None
    if told is None or variable is None:
        return None
    indices, shape = [int(i) for i in told["indices"].split(",")], shape_of(variable)
    if len(indices) != len(shape) or not all(
        1 <= i <= most for i, most in zip(indices, shape, strict=True)
    ):
        return None
    return Element(variable, int(np.ravel_multi_index([i - 1 for i in indices], shape)))


def array_named(known: dict[str, Any], name: str) -> Any | None:
    """Return the array that a name means, with or without indices; None: there is none."""
    told = ELEMENT.fullmatch(name)
    variable = known.get(name) or (known.get(told["name"]) if told else None)
    return variable if variable is not None and is_array(variable) else None


def names(variables: Iterable[Any]) -> Iterator[str]:
    """Yield the names of all numbers of variables."""
    for variable in variables:
        for indices in product(*map(range, shape_of(variable))):
            yield _name(variable, indices) if is_array(variable) else str(variable.name)


def starts_of(variable: Any) -> list[str]:
    """Return the start values of all numbers of a variable as written; empty: it has none.

    An array may have one for all.
    """
    written = variable.start
    if written is None:
        return []
    told = [str(one) for one in written] if isinstance(written, list) else str(written).split()
    return told * count(variable) if len(told) == 1 else told


def start_numbers(variable: Any) -> tuple[float, ...]:
    """Return the start values of all numbers of a variable; 0 where it has none."""
    told = [_number(one) for one in starts_of(variable)]
    return tuple(told) if len(told) == count(variable) else (0.0,) * count(variable)


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
