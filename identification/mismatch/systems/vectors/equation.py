"""Expand an equation over vectors and matrices into one equation per element.

The element of a vector `angle` is `angle_1`, that of a matrix `stiffness_1_2`; in an equation it may
be written `angle[1]`, `stiffness[1, 2]`, and a part of them `angle[2:3]`, `stiffness[:, 1]`, where a
range includes both of its ends. A number applies to every element; the other operands have
the same shape. Factors 0 and 1 are omitted, so the row [0, 1] of a literal matrix gives just the
second element.
"""

import ast
from collections.abc import Callable, Mapping

import numpy as np

from slipbench.identification.mismatch.systems.expression import (
    OF_VECTORS,
    check_call,
    check_number,
    not_arithmetic_error,
    parsed,
    shortened,
)
from slipbench.identification.mismatch.systems.vectors.arrays import (
    MADE_BY,
    Array,
    disagreement,
    filled,
    limited,
)
from slipbench.identification.mismatch.systems.vectors.element import (
    Element,
    Shape,
    element_names,
    in_words,
)
from slipbench.identification.mismatch.systems.vectors.products import (
    function_of_vectors,
    matrix_product,
)
from slipbench.protocol.errors import InputError

OPERATIONS: Mapping[type[ast.AST], Callable[..., Element]] = {
    ast.Add: Element.plus,
    ast.Sub: Element.minus,
    ast.Mult: Element.times,
    ast.Div: Element.over,
    ast.Pow: Element.power,
    ast.USub: Element.negative,
    ast.UAdd: Element.positive,
}


def elements(text: str, shapes: Mapping[str, Shape], where: str) -> Array:
    """Return the text of each element of an equation, in its shape.

    shapes: of the vectors and matrices that it may name; any other name is a number. An equation
    without vectors is returned as written. Raises InputError.
    """
    tree = parsed(text, where).body
    if not any(_is_of_vectors(node, shapes) for node in ast.walk(tree)):
        return filled((), lambda _: text)
    found = _Reader(shapes, where).of(tree)
    return filled(found.shape, lambda index: found[index].text)


def _is_of_vectors(node: ast.AST, shapes: Mapping[str, Shape]) -> bool:
    if isinstance(node, ast.Name):
        return node.id in shapes
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id in OF_VECTORS
    return isinstance(node, ast.List | ast.Subscript | ast.MatMult)


class _Reader:
    """Reads the parts of one equation. shapes: of its vectors; where: for messages."""

    def __init__(self, shapes: Mapping[str, Shape], where: str) -> None:
        self._shapes, self._where = shapes, where

    def of(self, node: ast.expr) -> Array:
        """Return the elements of a part. Raises InputError."""
        match node:
            case ast.Constant(value=value):
                check_number(value, self._where)
                return filled((), lambda _: Element(node))
            case ast.Name(id=name):
                names = element_names(name, shape := self._shapes.get(name, ()))
                return filled(shape, lambda i: Element(ast.Name(names[i], ast.Load())))
            case ast.List(elts=rows):
                return self._list(node, rows)
            case ast.Subscript(value=whole, slice=index):
                return self._indexed(node, whole, index)
            case ast.IfExp(test=ast.Compare() as test, body=body, orelse=other):
                return self._each(node, self._comparison(test).choice, body, other)
            case ast.Call():
                return self._call(node)
        return self._operation(node)

    def _operation(self, node: ast.expr) -> Array:
        match node:
            case ast.BinOp(left=left, op=ast.MatMult(), right=right):
                return matrix_product(node, self._where, self.of(left), self.of(right))
            case ast.BinOp(left=left, op=op, right=right) if type(op) in OPERATIONS:
                return self._each(node, OPERATIONS[type(op)], left, right)
            case ast.UnaryOp(op=sign, operand=operand) if type(sign) in OPERATIONS:
                return self._each(node, OPERATIONS[type(sign)], operand)
        raise not_arithmetic_error(shortened(ast.unparse(node)), self._where)

    def _each(self, node: ast.expr, act: Callable[..., Element], *parts: ast.expr) -> Array:
        """Apply an operation to each element; a number applies to every element of the others."""
        read = [self.of(part) for part in parts]
        shape: Shape = next((r.shape for r in read if r.shape), ())
        for part, r in zip(parts, read, strict=True):
            if r.shape not in ((), shape):
                product = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult)
                remedy = "write @ for a product of matrices" if product else ""
                raise disagreement(part, self._where, in_words(shape), r.shape, remedy)
        return limited(
            node, self._where, shape, lambda i: act(*(r[i] if r.shape else r[()] for r in read))
        )

    def _list(self, node: ast.expr, parts: list[ast.expr]) -> Array:
        """Return a vector of numbers, or the matrix whose rows are vectors."""
        rows = [self.of(part) for part in parts]
        if not rows:
            raise disagreement(node, self._where, "1 element or more", (0,))
        for part, row in zip(parts, rows, strict=True):
            if row.ndim > 1:
                raise disagreement(part, self._where, "a number or a row in a list", row.shape)
            if row.shape != rows[0].shape:
                first = in_words(rows[0].shape)
                raise disagreement(part, self._where, f"{first} in each row", row.shape)
        shape = (len(rows), *rows[0].shape)
        return limited(node, self._where, shape, lambda i: rows[i[0]][i[1:]])

    def _indexed(self, node: ast.expr, quantity: ast.expr, index: ast.expr) -> Array:
        """Return an element, a row or a part; indices begin at 1 and ranges include both ends."""
        whole = self.of(quantity)
        indices = index.elts if isinstance(index, ast.Tuple) else [index]
        if len(indices) > whole.ndim:
            expected = f"a quantity of {len(indices)} {'indices' if len(indices) > 1 else 'index'}"
            remedy = "" if whole.ndim else MADE_BY
            raise disagreement(quantity, self._where, expected, whole.shape, remedy)
        at = tuple(self._at(i, m, node) for i, m in zip(indices, whole.shape, strict=False))
        found = whole[at]
        return found if isinstance(found, np.ndarray) else filled((), lambda _: found)

    def _at(self, index: ast.expr, most: int, node: ast.expr) -> int | slice:
        if not isinstance(index, ast.Slice):
            return self._index(index, most, node) - 1
        first = self._index(index.lower, most, node) if index.lower else 1
        last = self._index(index.upper, most, node) if index.upper else most
        if first <= last and index.step is None:
            return slice(first - 1, last)
        raise InputError(
            "a range has no elements, or has a step",
            where=self._where,
            expected="first:last, both of them included, the first not after the last",
            found=f"{ast.unparse(index)} in {shortened(ast.unparse(node))}",
        )

    def _index(self, index: ast.expr, most: int, node: ast.expr) -> int:
        value = index.value if isinstance(index, ast.Constant) else None
        if isinstance(value, int) and not isinstance(value, bool) and 1 <= value <= most:
            return value
        raise InputError(
            "an element does not exist",
            where=self._where,
            expected=f"an index that is a whole number from 1 to {most}",
            found=f"{ast.unparse(index)} in {shortened(ast.unparse(node))}",
        )

    def _comparison(self, node: ast.Compare) -> Element:
        """Return a comparison of numbers."""
        sides = [node.left, *node.comparators]
        read = [self.of(side) for side in sides]
        for side, r in zip(sides, read, strict=True):
            if r.shape:
                remedy = "compare an element, as in v[1]; max, min and abs act on every element"
                raise disagreement(side, self._where, "1 number in a comparison", r.shape, remedy)
        return Element.comparison(node.ops, [r.item() for r in read])

    def _call(self, node: ast.Call) -> Array:
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if len(node.args) == OF_VECTORS.get(name) and not node.keywords:
            arguments = [self.of(argument) for argument in node.args]
            return function_of_vectors(node, name, self._where, arguments)
        check_call(node, self._where)
        return self._each(node, Element.called(name), *node.args)
