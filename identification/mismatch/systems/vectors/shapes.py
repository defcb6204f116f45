"""Shapes that the entries of a model file declare, and their checks."""

from collections import Counter
from collections.abc import Mapping
from math import prod
from typing import Any

from slipbench.identification.mismatch.systems.expression import FUNCTIONS
from slipbench.identification.mismatch.systems.vectors.element import (
    MOST_ELEMENTS,
    Shape,
    element_names,
)
from slipbench.protocol.errors import InputError

ROLE, LENGTH = "role", "length"
Tree = Mapping[str, Any]


def declared_shape(part: str, entry: Tree, where: str) -> Shape:
    """Return the shape that an entry itself has; that of a seam follows from its equation.

    Raises InputError for lists that are neither vector nor matrix, and for too many elements.
    """
    if part == "states" and LENGTH in entry:
        length = entry[LENGTH]
        if isinstance(length, bool) or not isinstance(length, int) or length < 1:
            raise InputError(
                "a length is a whole number of elements, 1 or more",
                where=f"{where}.{LENGTH}",
                found=repr(length),
            )
        return _within_limit((length,), f"{where}.{LENGTH}")
    key = {"parameters": "value", "inputs": ROLE, "outputs": ROLE}.get(part, "")
    return _within_limit(list_shape(entry.get(key), f"{where}.{key}"), f"{where}.{key}")


def list_shape(value: Any, where: str) -> Shape:
    """Return the shape of a list of a file; () where it is none. Raises InputError."""
    if not isinstance(value, list):
        return ()
    inner = {list_shape(one, where) for one in value}
    if len(inner) != 1 or len(row := inner.pop()) > 1:
        raise InputError(
            "a list is neither a vector nor a matrix",
            where=where,
            expected="[1, 2], or rows of the same length: [[1, 2], [3, 4]]",
            found=str(value)[:60],
        )
    return (len(value), *row)


def _within_limit(shape: Shape, where: str) -> Shape:
    if prod(shape) > MOST_ELEMENTS:
        raise _too_many(prod(shape), where)
    return shape


def _too_many(count: int, where: str) -> InputError:
    return InputError(
        "too many elements", where=where, expected=f"at most {MOST_ELEMENTS}", found=f"{count}"
    )


def check_states(states: Tree, shapes: Mapping[str, Shape], where: str) -> None:
    """Raise InputError where states have too many elements together."""
    count = sum(shapes.get(name, (1,))[0] for name in states)
    if count > MOST_ELEMENTS:
        raise _too_many(count, f"{where}: states")


def check_names(parts: Mapping[str, Tree], shapes: Mapping[str, Shape], where: str) -> None:
    """Raise InputError where a vector, or an element of it, has the name of another quantity."""
    counts = Counter(name for entries in parts.values() for name in entries)
    taken = set(counts)
    for vector, shape in shapes.items():
        if counts[vector] > 1 or vector in FUNCTIONS:
            raise InputError(
                f"{vector!r} is defined twice, or is the name of a function", where=where
            )
        for element in element_names(vector, shape).values():
            if element in taken:
                raise InputError(
                    f"{element!r} is defined twice",
                    where=where,
                    found=f"an element of {vector!r} and another quantity",
                    remedy="rename one of them",
                )
            taken.add(element)
