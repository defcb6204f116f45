"""Evaluate an equation of a model file for given quantities; only arithmetic is allowed.

Quantities are constant in time: a delayed quantity has its present value.
"""

import ast
import builtins
import math
import operator
from collections.abc import Callable, Mapping
from typing import Any

from slipbench.identification.mismatch.systems.expression import FUNCTIONS

MATH = "math."
BINARY: Mapping[type, Callable[[float, float], Any]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
}
COMPARISONS: Mapping[type, Callable[[float, float], bool]] = {
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
}
CALLS: Mapping[str, Callable[..., float]] = {
    name: getattr(math, text[len(MATH) :]) if text.startswith(MATH) else getattr(builtins, text)
    for name, text in FUNCTIONS.items()
}


def value_of(text: str, known: Mapping[str, float]) -> float:
    """Return the value of an equation that `read_expression` accepts.

    known: quantities by name, SI. Raises ArithmeticError or ValueError where it is undefined.
    """
    return _value(ast.parse(text.strip(), mode="eval").body, known)


def _value(node: ast.expr, known: Mapping[str, float]) -> float:
    match node:
        case ast.Constant(value=int() | float() as value):
            return float(value)
        case ast.Name(id=name):
            return known[name]
        case ast.UnaryOp(op=op, operand=operand):
            value = _value(operand, known)
            return -value if isinstance(op, ast.USub) else value
        case ast.BinOp(left=left, op=op, right=right):
            return _real(BINARY[type(op)](_value(left, known), _value(right, known)))
        case ast.IfExp(test=test, body=body, orelse=other):
            return _value(body if _value(test, known) else other, known)
        case ast.Compare(left=left, ops=ops, comparators=others):
            sides = [_value(side, known) for side in (left, *others)]
            pairs = zip(ops, sides, sides[1:], strict=False)
            return float(all(COMPARISONS[type(op)](a, b) for op, a, b in pairs))
        case ast.Call(func=ast.Name(id="delay"), args=[quantity, _]):
            return _value(quantity, known)
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return float(CALLS[name](*(_value(side, known) for side in arguments)))
    raise ValueError(f"no arithmetic: {ast.unparse(node)}")


def _real(value: float | complex) -> float:
    if isinstance(value, complex):
        raise ValueError("a power of a negative number")
    return value
