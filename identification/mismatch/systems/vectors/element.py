"""Elements of vectors and matrices: their names, and the arithmetic of their equations."""

import ast
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np

from slipbench.identification.mismatch.systems.expression import DEEPEST, LONGEST, SPLIT, too_deep
from slipbench.protocol.errors import InputError

Shape = tuple[int, ...]
"""() a number, (n,) a vector, (m, n) a matrix."""
MOST_ELEMENTS = 200
"""Elements of a vector or matrix, and of all states of a file together."""
MOST_PARTS = LONGEST // 2
"""Operations of the equation of an element."""


def element_names(name: str, shape: Shape) -> dict[tuple[int, ...], str]:
    """Return the name of each element by its index from 0: angle_1, stiffness_1_2."""
    return {index: "_".join([name, *(str(k + 1) for k in index)]) for index in np.ndindex(shape)}


def in_words(shape: Shape) -> str:
    """Return a shape as text."""
    if len(shape) == 1:
        return f"{shape[0]} element{'s' if shape[0] != 1 else ''}"
    return " x ".join(map(str, shape)) + " elements" if shape else "1 number"


@dataclass(frozen=True)
class Element:
    """An equation of one element. node: its syntax tree; parts, depth: operations, and nested ones.

    The arithmetic omits factors 0 and 1 and terms 0. For finite numbers this changes no value,
    except the sign of a zero.
    """

    node: ast.expr
    parts: int = 0
    depth: int = 0

    @property
    def text(self) -> str:
        """The equation."""
        return ast.unparse(ast.fix_missing_locations(self.node))

    def check(self, where: str) -> None:
        """Raise InputError where the equation is too large."""
        if self.parts > MOST_PARTS:
            raise InputError(
                "the equation of an element is too long",
                where=where,
                expected=f"at most {MOST_PARTS} operations",
                found=f"{self.parts}",
                remedy=SPLIT,
            )
        if self.depth > DEEPEST:
            raise too_deep(where, str(self.depth))

    def negative(self) -> "Element":
        """-a."""
        if isinstance(self.node, ast.UnaryOp):
            return Element(self.node.operand, self.parts - 1, self.depth)
        return self if self._is(0) else _made(ast.UnaryOp(ast.USub(), self.node), self)

    def positive(self) -> "Element":
        """+a."""
        return self

    def plus(self, other: "Element") -> "Element":
        """a + b."""
        if self._is(0) or other._is(0):
            return self if other._is(0) else other
        if isinstance(other.node, ast.UnaryOp):
            return self.minus(other.negative())
        return _made(ast.BinOp(self.node, ast.Add(), other.node), self, other)

    def minus(self, other: "Element") -> "Element":
        """a - b."""
        if self._is(0) or other._is(0):
            return self if other._is(0) else other.negative()
        if isinstance(other.node, ast.UnaryOp):
            return self.plus(other.negative())
        return _made(ast.BinOp(self.node, ast.Sub(), other.node), self, other)

    def times(self, other: "Element") -> "Element":
        """a b."""
        for one, factor in ((self, other), (other, self)):
            if factor._is(0):
                return factor
            if factor._is(1):
                return one
            if isinstance(factor.node, ast.UnaryOp):
                return one.times(factor.negative()).negative()
        return _made(ast.BinOp(self.node, ast.Mult(), other.node), self, other)

    def over(self, other: "Element") -> "Element":
        """a / b."""
        return _made(ast.BinOp(self.node, ast.Div(), other.node), self, other)

    def power(self, other: "Element") -> "Element":
        """a ** b."""
        return _made(ast.BinOp(self.node, ast.Pow(), other.node), self, other)

    def squared(self) -> "Element":
        """a ** 2."""
        return self.power(Element(ast.Constant(2)))

    def choice(self, body: "Element", other: "Element") -> "Element":
        """Return body where this comparison holds, else the other."""
        return _made(ast.IfExp(self.node, body.node, other.node), self, body, other)

    @staticmethod
    def comparison(ops: Sequence[ast.cmpop], sides: Sequence["Element"]) -> "Element":
        """Return a comparison of two or more sides."""
        node = ast.Compare(sides[0].node, list(ops), [side.node for side in sides[1:]])
        return _made(node, *sides)

    @staticmethod
    def called(name: str) -> Callable[..., "Element"]:
        """Return a function of elements by its name."""

        def call(*arguments: Element) -> Element:
            function = ast.Name(name, ast.Load())
            return _made(ast.Call(function, [a.node for a in arguments], []), *arguments)

        return call

    @staticmethod
    def total(terms: Iterable["Element"]) -> "Element":
        """Return the sum of terms, from left to right."""
        return reduce(Element.plus, terms)

    def _is(self, value: int) -> bool:
        constant: Any = self.node.value if isinstance(self.node, ast.Constant) else None
        return bool(constant == value)


def _made(node: ast.expr, *parts: Element) -> Element:
    return Element(node, 1 + sum(p.parts for p in parts), 1 + max(p.depth for p in parts))
