"""Vectors and matrices of equations: an `Element` for each element of a part of an equation."""

import ast
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from slipbench.identification.mismatch.systems.expression import shortened
from slipbench.identification.mismatch.systems.vectors.element import (
    MOST_ELEMENTS,
    Element,
    Shape,
    in_words,
)
from slipbench.protocol.errors import InputError

Array = NDArray[Any]
"""Elements, or their texts, in the shape of the quantity."""
At = tuple[int, ...]
"""Index of an element, from 0."""
MADE_BY = (
    "a vector is a state with a length, an input with a list of roles, a parameter with a list of"
    " values, or a seam whose equation gives one"
)
"""Remedy where a vector is expected."""


def filled(shape: Shape, at: Callable[[At], Any]) -> Array:
    """Return an array of a shape, with the value of a function of each index."""
    array = np.empty(shape, dtype=object)
    for index in np.ndindex(shape):
        array[index] = at(index)
    return array


def limited(node: ast.expr, where: str, shape: Shape, at: Callable[[At], Element]) -> Array:
    """Return the elements of a part, in its shape.

    Raises InputError for too many or too large ones.
    """
    if np.prod(shape, dtype=int) > MOST_ELEMENTS:
        raise disagreement(node, where, f"at most {MOST_ELEMENTS} elements", shape)
    array = filled(shape, at)
    for element in array.flat:
        element.check(where)
    return array


def disagreement(
    node: ast.expr, where: str, expected: str, found: Shape, remedy: str = ""
) -> InputError:
    """Return the error for a part of an equation with an unexpected shape."""
    return InputError(
        "shapes do not agree",
        where=where,
        expected=expected,
        found=f"{in_words(found)} in {shortened(ast.unparse(node))}",
        remedy=remedy,
    )
