"""Products of vectors and matrices in equations, and the functions of vectors."""

import ast

from slipbench.identification.mismatch.systems.vectors.arrays import (
    MADE_BY,
    Array,
    At,
    disagreement,
    filled,
    limited,
)
from slipbench.identification.mismatch.systems.vectors.element import Element, Shape, in_words

DIMENSIONS = {"transpose": 2}
"""Dimensions of the arguments of functions that do not take vectors."""
KINDS = ("a number", "a vector", "a matrix")


def matrix_product(node: ast.BinOp, where: str, left: Array, right: Array) -> Array:
    """Return left @ right, of vectors the scalar product.

    left: (n,) or (m, n); right: (n,) or (n, k). Raises InputError where a side is a number, where
    the lengths do not agree, and as `limited` does.
    """
    for part, side in ((node.left, left), (node.right, right)):
        if not side.ndim:
            remedy = f"write * for the product with a number; {MADE_BY}"
            raise disagreement(part, where, "a vector or a matrix beside @", (), remedy)
    if left.shape[-1] != right.shape[0]:
        expected = f"{left.shape[-1]} elements, or rows, after @"
        raise disagreement(node.right, where, expected, right.shape)
    rows = left.ndim - 1

    def at(index: At) -> Element:
        pairs = ((left[(*index[:rows], k)], right[(k, *index[rows:])]) for k in range(len(right)))
        return Element.total(a.times(b) for a, b in pairs)

    return limited(node, where, (*left.shape[:-1], *right.shape[1:]), at)


def function_of_vectors(node: ast.Call, name: str, where: str, arguments: list[Array]) -> Array:
    """Return a function of vectors or a matrix (expression.OF_VECTORS).

    arguments: a matrix (m, n) of transpose, vectors (n,) of the same length of the others, (3,) of
    cross. Raises InputError for other shapes, and as `limited` does.
    """
    _check(node, name, where, arguments)
    first, last = arguments[0], arguments[-1]
    if name == "transpose":
        return filled(first.shape[::-1], lambda index: first[index[::-1]])
    if name == "cross":
        return limited(node, where, (3,), lambda index: _cross(first, last, index[0]))
    return limited(node, where, (), lambda _: _number(name, first, last))


def _check(node: ast.Call, name: str, where: str, arguments: list[Array]) -> None:
    """Raise InputError unless the arguments have the dimensions of a function and one shape."""
    dimensions = DIMENSIONS.get(name, 1)
    required: Shape | None = (3,) if name == "cross" else None
    for part, found in zip(node.args, arguments, strict=True):
        if found.ndim != dimensions or (required and found.shape != required):
            expected = in_words(required) if required else KINDS[dimensions]
            raise disagreement(part, where, f"{expected} in {name}", found.shape)
        required = found.shape


def _number(name: str, first: Array, last: Array) -> Element:
    """Return the sum or the norm of a vector, or the scalar product of two."""
    if name == "sum":
        return Element.total(first)
    if name == "dot":
        return Element.total(a.times(b) for a, b in zip(first, last, strict=True))
    return Element.called("sqrt")(Element.total(a.squared() for a in first))


def _cross(a: Array, b: Array, k: int) -> Element:
    i, j = (k + 1) % 3, (k + 2) % 3
    return a[i].times(b[j]).minus(a[j].times(b[i]))  # type: ignore[no-any-return]
