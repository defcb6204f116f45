"""Check that both sides of each equation of a model file have the same unit.

A rate must have the unit of its state divided by seconds, a seam and an output that of their size;
terms of a sum, the branches of a conditional and both sides of a comparison must agree; arguments
of functions have no unit. A literal number has no unit in a product, and in a sum the unit of the
other terms. Angles have no unit. The time of a delay is in seconds.
"""

import ast
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction

from slipbench.identification.mismatch.systems.expression import DELAY, parsed
from slipbench.identification.mismatch.systems.model_file import ModelFile, Number
from slipbench.protocol.units import Powers, powers_of

SECOND: Powers = {"s": Fraction(1)}
AS_THE_FIRST = ("abs", "min", "max")
NO_UNIT = ("tanh", "exp", "log", "sin", "cos", "tan", "atan")


@dataclass(eq=False)
class _DisagreementError(Exception):
    """Inconsistent units. part: of an equation. found, expected: units that must agree."""

    part: str
    found: str
    expected: str


def unit_faults(file: ModelFile, where: str) -> tuple[str, ...]:
    """Return a message for each equation with inconsistent units; () where all are consistent."""
    return tuple(_faults(file, where))


def _faults(file: ModelFile, where: str) -> Iterator[str]:
    known: dict[str, Powers] = {"time": SECOND}
    known |= {name: powers_of(number.unit) for name, number in file.parameters.items()}
    for part in (file.inputs, file.states, file.seams):
        known |= {name: powers_of(entry.size.unit) for name, entry in part.items()}
    sides = [
        *((f"seams.{n}.value", s.value, known[n]) for n, s in file.seams.items()),
        *(
            (f"states.{n}.rate", s.rate, _times(known[n], SECOND, -1))
            for n, s in file.states.items()
        ),
        *((f"outputs.{n}.value", o.value, powers_of(o.size.unit)) for n, o in file.outputs.items()),
    ]
    for key, text, expected in sides:
        try:
            found = _Units(known).of(parsed(text, f"{where}: {key}").body)
            if found is not None and found != expected:
                raise _DisagreementError(text, in_words(found), in_words(expected))
        except _DisagreementError as d:
            yield (
                f"{where}: {key}: units do not agree: {d.expected} is expected, {d.found} found,"
                f" in {d.part}"
            )
    yield from _stop_faults(file, known, where)


def _stop_faults(file: ModelFile, known: Mapping[str, Powers], where: str) -> Iterator[str]:
    """Yield a message for each stop whose unit is not that of its state."""
    for name, state in file.states.items():
        for key, limit, expected in (
            ("low", state.low, known[name]),
            ("high", state.high, known[name]),
            ("restitution", state.restitution, {}),
        ):
            if isinstance(limit, str | Number):
                found = known[limit] if isinstance(limit, str) else powers_of(limit.unit)
                if found != expected:
                    yield (
                        f"{where}: states.{name}.{key}: units do not agree: {in_words(expected)} is"
                        f" expected, {in_words(found)} found"
                    )


def in_words(powers: Powers) -> str:
    """Return a unit as text: kg m/s^2 as "kg m s^-2"."""
    factors = [f"{name}^{p}" if p != 1 else name for name, p in sorted(powers.items())]
    return " ".join(factors) or "1"


def _times(one: Powers, other: Powers, power: Fraction | int = 1) -> Powers:
    """Return the unit one other^power."""
    sums = {n: one.get(n, Fraction(0)) + power * other.get(n, Fraction(0)) for n in {*one, *other}}
    return {n: p for n, p in sums.items() if p}


@dataclass(frozen=True)
class _Units:
    """Units of the parts of an equation; None: a literal number, which agrees with any unit."""

    known: Mapping[str, Powers]

    def of(self, node: ast.expr) -> Powers | None:
        """Return the unit of a part. Raises _DisagreementError."""
        unit_by_type: dict[type[ast.expr], Callable[..., Powers | None]] = {
            ast.Constant: lambda _: None,
            ast.Name: lambda n: self.known[n.id],
            ast.UnaryOp: lambda n: self.of(n.operand),
            ast.BinOp: self._operation,
            ast.Call: self._call,
            ast.IfExp: self._conditional,
            ast.Compare: self._comparison,
        }
        return unit_by_type[type(node)](node)

    def _operation(self, node: ast.BinOp) -> Powers | None:
        left, right = self.of(node.left), self.of(node.right)
        if isinstance(node.op, ast.Add | ast.Sub):
            return self._consistent(node.right, right, left)
        if isinstance(node.op, ast.Pow):
            return self._power(node, left, right)
        if left is None and right is None:
            return None
        return _times(left or {}, right or {}, 1 if isinstance(node.op, ast.Mult) else -1)

    def _power(
        self, node: ast.BinOp, base: Powers | None, exponent: Powers | None
    ) -> Powers | None:
        self._without_unit(node.right, exponent)
        value = _constant(node.right)
        if value is None:
            return self._without_unit(node.left, base)
        return None if base is None else _times({}, base, value)

    def _call(self, node: ast.Call) -> Powers | None:
        assert isinstance(node.func, ast.Name)
        name, units = node.func.id, [self.of(a) for a in node.args]
        if name == "sqrt":
            return None if units[0] is None else _times({}, units[0], Fraction(1, 2))
        if name == DELAY:
            self._consistent(node.args[1], units[1], SECOND)
            return units[0]
        if name in NO_UNIT:
            return self._without_unit(node.args[0], units[0])
        same = units[0]
        for argument, unit in zip(node.args[1:], units[1:], strict=True):
            same = self._consistent(argument, unit, same)
        return same if name in AS_THE_FIRST else {}

    def _conditional(self, node: ast.IfExp) -> Powers | None:
        self.of(node.test)
        return self._consistent(node.orelse, self.of(node.orelse), self.of(node.body))

    def _comparison(self, node: ast.Compare) -> Powers | None:
        first = self.of(node.left)
        for other in node.comparators:
            first = self._consistent(other, self.of(other), first)
        return {}

    def _consistent(
        self, part: ast.expr, found: Powers | None, other: Powers | None
    ) -> Powers | None:
        if found is not None and other is not None and found != other:
            raise _DisagreementError(ast.unparse(part), in_words(found), in_words(other))
        return found if other is None else other

    def _without_unit(self, part: ast.expr, found: Powers | None) -> Powers:
        if found:
            raise _DisagreementError(ast.unparse(part), in_words(found), in_words({}))
        return {}


def _constant(node: ast.expr) -> Fraction | None:
    """Return the value of a constant exponent; None: it is not constant."""
    sign = 1
    while isinstance(node, ast.UnaryOp):
        sign, node = (-sign if isinstance(node.op, ast.USub) else sign), node.operand
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div):
        upper, lower = _constant(node.left), _constant(node.right)
        return sign * upper / lower if upper is not None and lower else None
    if isinstance(node, ast.Constant) and math.isfinite(value := float(node.value)):  # type: ignore[arg-type]
        return sign * Fraction(value).limit_denominator(1000)
    return None
