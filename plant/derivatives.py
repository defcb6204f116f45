"""Partial derivatives of a plain function of floats, made from its own text.

Forward mode by source transformation (Griewank and Walther, "Evaluating Derivatives", ch. 3 and 6):
each assignment of the function is preceded by the assignments of its tangents, one for each
direction in which the variable can change. What cannot change in a direction has no code for it.
At a kink (min, max, abs, a comparison) the derivative is that of the branch taken.

Known are assignments, if/else, loops over a range, conditional expressions, arithmetic, `math`,
min, max, abs, tuples, and calls of other plain functions.
"""

import ast
import inspect
import sys
import textwrap
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property
from typing import Any

UNARY = {
    "exp": "math.exp({0})",
    "log": "1.0 / ({0})",
    "sqrt": "0.5 / math.sqrt({0})",
    "sin": "math.cos({0})",
    "cos": "-math.sin({0})",
    "tan": "1.0 + math.tan({0}) ** 2",
    "atan": "1.0 / (1.0 + ({0}) ** 2)",
    "tanh": "1.0 - math.tanh({0}) ** 2",
    "sinh": "math.cosh({0})",
    "cosh": "math.sinh({0})",
    "fabs": "math.copysign(1.0, {0})",
    "floor": "",
    "ceil": "",
}
"""Derivative of each function of `math` with one argument; empty: zero."""
CONSTANT = ("int", "len", "round")
Directions = Mapping[str, str]
"""By direction, the text of a variable's tangent."""


@dataclass(frozen=True)
class Derivative:
    """A function that returns the values of another and its partial derivatives.

    text: of the function; pairs: (number of the result, direction) of each derivative that follows
    the results, in their order; results: how many there are; helpers: texts of the functions that
    it calls, by name.
    """

    text: str
    results: int
    pairs: tuple[tuple[int, str], ...]
    helpers: Mapping[str, str]


def gradient(function: Callable[..., Any], name: str, arguments: Sequence[str]) -> Derivative:
    """Values of a function and its partial derivatives to some of its arguments.

    Raises NotImplementedError, with function and line, for what the transformation does not know.
    """
    work = _Work(function, {a: {a: "1.0"} for a in arguments})
    return work.made(name, work.arguments, values=True)


def directional(function: Callable[..., Any], name: str, arguments: Sequence[str]) -> Derivative:
    """Values of a function and its derivative in one direction.

    The new function takes the tangents of the given arguments after all arguments, each a number,
    or a tuple for an argument that is one. Raises as `gradient` does.
    """
    work = _Work(function, {a: {"t": f"{a}__t"} for a in arguments})
    return work.made(name, [*work.arguments, *(f"{a}__t" for a in arguments)], values=True)


@dataclass
class _Work:
    """The transformation of one function. seeds: directions of its arguments."""

    function: Callable[..., Any]
    seeds: dict[str, dict[str, str]]
    tree: ast.FunctionDef = field(init=False)
    line: int = field(init=False)
    active: dict[str, set[str]] = field(init=False)
    helpers: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        lines, first = inspect.getsourcelines(self.function)
        tree = ast.parse(textwrap.dedent("".join(lines))).body[0]
        assert isinstance(tree, ast.FunctionDef)
        self.tree, self.line = tree, first - 1
        self.active = {a: set(d) for a, d in self.seeds.items()}
        before = -1
        while before != (now := sum(map(len, self.active.values()))):
            before = now
            for assign in ast.walk(tree):
                if isinstance(assign, ast.Assign | ast.AugAssign):
                    self._spread(assign)

    @property
    def arguments(self) -> list[str]:
        """Names of the arguments."""
        return [a.arg for a in self.tree.args.args]

    @cached_property
    def _assigned(self) -> set[str]:
        """Names that the function assigns; the tree stays as it is."""
        names = (n for n in ast.walk(self.tree) if isinstance(n, ast.Name))
        return {n.id for n in names if isinstance(n.ctx, ast.Store)}

    def made(self, name: str, arguments: Sequence[str], values: bool) -> Derivative:
        """The function under a name. values: whether it returns the values as well."""
        returned = [n for n in ast.walk(self.tree) if isinstance(n, ast.Return)]
        results = [len(_elements(n.value)) for n in returned if n.value is not None]
        if not results or len(set(results)) != 1 or len(results) != len(returned):
            raise self._unknown(self.tree, "returns that differ in length")
        pairs = tuple(
            (r, k)
            for r in range(results[0])
            for k in dict.fromkeys(k for d in self.seeds.values() for k in d)
            if any(self._of(_elements(n.value)[r], k) for n in returned)
        )
        starts = [(a, k) for a in self.seeds if a in self._assigned for k in sorted(self.active[a])]
        body = [f"    {a}__{k} = {self.seeds[a].get(k, '0.0')}" for a, k in starts]
        for statement in self.tree.body:
            body += [f"    {line}" for line in self._statement(statement, pairs, values)]
        text = "\n".join([f"def {name}({', '.join(arguments)}):", *body])
        return Derivative(text, results[0], pairs, self.helpers)

    def _spread(self, node: ast.Assign | ast.AugAssign) -> None:
        """Count the directions in which the assigned variables can change."""
        for target, value in self._parts(node):
            every = {k for d in self.active.values() for k in d}
            found = {k for k in every if self._of(value, k)}
            self.active.setdefault(target, set()).update(found)

    def _parts(self, node: ast.Assign | ast.AugAssign) -> list[tuple[str, ast.expr]]:
        """The assigned names and what each of them gets."""
        if isinstance(node, ast.AugAssign):
            target, value = node.target, node.value
            if isinstance(target, ast.Name):
                old = ast.Name(target.id, ast.Load())
                return [(target.id, ast.copy_location(ast.BinOp(old, node.op, value), node))]
        elif len(node.targets) == 1:
            names, value = node.targets[0], node.value
            if isinstance(names, ast.Name):
                return [(names.id, value)]
            targets, values = _elements(names), _elements(value)
            if len(targets) == len(values) and all(isinstance(t, ast.Name) for t in targets):
                return [(ast.unparse(t), v) for t, v in zip(targets, values, strict=True)]
        raise self._unknown(node, "an assignment of this form")

    def _statement(
        self, node: ast.stmt, pairs: Sequence[tuple[int, str]], values: bool
    ) -> Iterator[str]:
        """Yield the lines of a statement, its tangents before it."""
        if isinstance(node, ast.Assign | ast.AugAssign):
            parts = self._parts(node)
            for k in sorted({k for target, _ in parts for k in self.active[target]}):
                moving = [(t, v) for t, v in parts if k in self.active[t]]
                slopes = ", ".join(self._of(v, k) or "0.0" for _, v in moving)
                yield f"{', '.join(f'{t}__{k}' for t, _ in moving)} = {slopes}"
            yield ast.unparse(node)
        elif isinstance(node, ast.Return):
            assert node.value is not None
            results = _elements(node.value)
            shown = [ast.unparse(r) for r in results] if values else []
            shown += [self._of(results[r], k) or "0.0" for r, k in pairs]
            yield f"return {', '.join(shown) or '0.0'}"
        elif isinstance(node, ast.If):
            yield f"if {ast.unparse(node.test)}:"
            yield from self._body(node.body, pairs, values)
            if node.orelse:
                yield "else:"
                yield from self._body(node.orelse, pairs, values)
        elif isinstance(node, ast.For) and not node.orelse and _over_range(node):
            yield f"for {ast.unparse(node.target)} in {ast.unparse(node.iter)}:"
            yield from self._body(node.body, pairs, values)
        elif not (isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)):
            raise self._unknown(node, f"a statement of the kind '{type(node).__name__}'")

    def _body(
        self, body: Sequence[ast.stmt], pairs: Sequence[tuple[int, str]], values: bool
    ) -> Iterator[str]:
        for statement in body:
            for line in self._statement(statement, pairs, values):
                yield f"    {line}"

    def _of(self, node: ast.expr | None, k: str) -> str | None:
        """The text of an expression's derivative in a direction; None where it is zero."""
        match node:
            case ast.Constant() | ast.Attribute() | ast.Compare():
                return None
            case ast.Name(id=name):
                return self._of_name(name, k)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                d = self._of(operand, k)
                return d and f"(-{d})"
            case ast.BinOp():
                return self._of_operation(node, k)
            case ast.IfExp(test=test, body=a, orelse=b):
                return _either(ast.unparse(test), self._of(a, k), self._of(b, k))
            case ast.BoolOp(op=ast.Or(), values=[a, b]):
                return _either(f"{ast.unparse(a)} != 0.0", self._of(a, k), self._of(b, k))
            case ast.Tuple(elts=parts):
                each = [self._of(part, k) for part in parts]
                return f"({', '.join(d or '0.0' for d in each)},)" if any(each) else None
            case ast.Subscript(value=ast.Name(id=name), slice=place):
                d = self._of_name(name, k)
                return d and f"{d}[{ast.unparse(place)}]"
            case ast.Call():
                return self._of_call(node, k)
        raise self._unknown(node, f"an expression of the kind '{type(node).__name__}'")

    def _of_name(self, name: str, k: str) -> str | None:
        if k not in self.active.get(name, ()):
            return None
        argument = name in self.seeds and name not in self._assigned
        return self.seeds[name][k] if argument else f"{name}__{k}"

    def _of_operation(self, node: ast.BinOp, k: str) -> str | None:
        a, b = ast.unparse(node.left), ast.unparse(node.right)
        da, db = self._of(node.left, k), self._of(node.right, k)
        match node.op:
            case ast.Add():
                return _sum(da, db)
            case ast.Sub():
                return _sum(da, db and f"(-{db})")
            case ast.Mult():
                return _sum(_product(da, b), _product(db, a))
            case ast.Div():
                return _sum(da and f"{da} / ({b})", db and f"(-({a}) / (({b}) * ({b})) * {db})")
            case ast.Pow() if db is None:
                slope = f"2.0 * ({a})" if b in ("2", "2.0") else f"({b}) * ({a}) ** ({b} - 1)"
                return _product(da, slope)
        if da or db:
            raise self._unknown(node, f"the operation '{ast.unparse(node)}'")
        return None

    def _of_call(self, node: ast.Call, k: str) -> str | None:
        name = ast.unparse(node.func)
        values = [ast.unparse(a) for a in node.args]
        slopes = [self._of(a, k) for a in node.args]
        if not any(slopes) or name in CONSTANT:
            return None
        if name in ("min", "max") and len(values) == 2:
            test = f"({values[0]}) {'<=' if name == 'min' else '>='} ({values[1]})"
            return _either(test, *slopes)
        if name == "abs":
            return _product(slopes[0], f"(1.0 if {values[0]} >= 0.0 else -1.0)")
        if name == "float":
            return slopes[0]
        if name == "math.pow":
            base, power = values
            a = _product(slopes[0], f"({power}) * math.pow({base}, {power} - 1.0)")
            return _sum(a, _product(slopes[1], f"math.pow({base}, {power}) * math.log({base})"))
        if name.startswith("math.") and name[5:] in UNARY and len(values) == 1:
            slope = UNARY[name[5:]].format(values[0])
            return _product(slopes[0], slope) if slope else None
        helper = vars(sys.modules[self.function.__module__]).get(name)
        if inspect.isfunction(helper):
            return self._of_helper(helper, values, slopes)
        raise self._unknown(node, f"a call of '{name}'")

    def _of_helper(
        self, helper: Callable[..., Any], values: list[str], slopes: list[str | None]
    ) -> str | None:
        """A call of the function that gives a helper's derivative in one direction."""
        names = list(inspect.signature(helper).parameters)
        moving = [(n, d) for n, d in zip(names, slopes, strict=True) if d]
        name, made = _along(helper, tuple(n for n, _ in moving))
        self.helpers.update({**made.helpers, name: made.text})
        return f"{name}({', '.join([*values, *(d for _, d in moving)])})" if made.pairs else None

    def _unknown(self, node: ast.AST | None, what: str) -> NotImplementedError:
        line = self.line + getattr(node, "lineno", 1)
        return NotImplementedError(
            f"{self.function.__qualname__}, line {line}: {what} has no derivative here; "
            "write it with assignments, if, for over a range, arithmetic, math, min, max and abs"
        )


@cache
def _along(helper: Callable[..., Any], moving: tuple[str, ...]) -> tuple[str, Derivative]:
    """Name and text of a helper's derivative in one direction, in which these arguments move."""
    names = list(inspect.signature(helper).parameters)
    name = "__".join([helper.__name__, "along", *moving])
    work = _Work(helper, {n: {"t": f"{n}__t"} for n in moving})
    return name, work.made(name, [*names, *(f"{n}__t" for n in moving)], values=False)


def _elements(node: ast.expr | None) -> list[ast.expr]:
    """The parts of a tuple, or the one expression."""
    if node is None:
        return []
    return list(node.elts) if isinstance(node, ast.Tuple) else [node]


def _over_range(node: ast.For) -> bool:
    return isinstance(node.iter, ast.Call) and ast.unparse(node.iter.func) == "range"


def _sum(a: str | None, b: str | None) -> str | None:
    return f"({a} + {b})" if a and b else a or b


def _product(slope: str | None, factor: str) -> str | None:
    if slope is None:
        return None
    return f"({factor})" if slope == "1.0" else f"({factor}) * {slope}"


def _either(test: str, a: str | None, b: str | None) -> str | None:
    return f"({a or '0.0'} if {test} else {b or '0.0'})" if a or b else None
