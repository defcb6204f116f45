"""Parse the equations of a model file; only arithmetic is accepted.

Python's parser reads the text, and each node of the syntax tree must be of an allowed type. An
accepted equation becomes text of a compiled kernel; the text of the file is never evaluated.

`delay(quantity, time)` is the quantity delayed by a time, which is a parameter or a number, s.
"""

import ast
import sys
from collections.abc import Collection, Iterable
from dataclasses import dataclass

from slipbench.plant.errors import nearest
from slipbench.protocol.errors import InputError

FUNCTIONS = {
    "sin": "math.sin",
    "cos": "math.cos",
    "tan": "math.tan",
    "atan": "math.atan",
    "atan2": "math.atan2",
    "exp": "math.exp",
    "log": "math.log",
    "sqrt": "math.sqrt",
    "tanh": "math.tanh",
    "abs": "abs",
    "min": "min",
    "max": "max",
}
DELAY = "delay"
ARGUMENTS = {"atan2": 2, "min": 2, "max": 2, DELAY: 2}
CALLED = (*FUNCTIONS, DELAY)
OF_VECTORS = {"sum": 1, "norm": 1, "transpose": 1, "dot": 2, "cross": 2}
"""Functions of vectors and matrices, and their numbers of arguments (vectors/equation.py)."""
ALLOWED = (
    ast.Expression,
    ast.BinOp,
    ast.UnaryOp,
    ast.IfExp,
    ast.Compare,
    ast.Call,
    ast.Name,
    ast.Constant,
    ast.Load,
    ast.Add,
    ast.Sub,
    ast.Mult,
    ast.Div,
    ast.Pow,
    ast.USub,
    ast.UAdd,
    ast.Lt,
    ast.LtE,
    ast.Gt,
    ast.GtE,
)
PREFIX = "q_"
LATE = "late_"
"""Prefix of the number of a delayed quantity of an equation."""
LONGEST = 1000
"""Largest number of characters of an equation."""
SHOWN = 60
"""Largest number of characters of a faulty part that a message quotes."""
DEEPEST = 100
"""Largest number of nested operations of an equation; a sum of n terms has n - 1."""
SPLIT = "split the equation into seams"


@dataclass(frozen=True)
class Delay:
    """A delayed quantity. text: its kernel text; time: name of a parameter, or a number, s."""

    text: str
    time: str | float


@dataclass(frozen=True)
class Expression:
    """A parsed equation. text: kernel text, every name with a prefix; names: names that it uses.

    delays: delayed quantities; the text names the first `late_0`, and each may use those before it.
    """

    text: str
    names: frozenset[str]
    delays: tuple[Delay, ...] = ()


def read_expression(
    text: str, known: Iterable[str], where: str, parameters: Collection[str] = ()
) -> Expression:
    """Parse one equation. known: names that it may use. Raises InputError.

    parameters: names that it may use as well, also as the time of a delay.
    """
    tree = parsed(text, where)
    names = frozenset(_names(tree, {*known, *parameters}, where))
    renamer = _Renamed(parameters, where)
    renamed = renamer.visit(tree)
    return Expression(_unparsed(renamed), names, tuple(renamer.delays))


def parsed(text: str, where: str) -> ast.Expression:
    """Return the syntax tree of an equation. Raises InputError if invalid or too large."""
    if len(text) > LONGEST:
        raise InputError(
            "an equation is too long",
            where=where,
            expected=f"at most {LONGEST} characters",
            found=f"{len(text)} characters",
            remedy=SPLIT,
        )
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (RecursionError, MemoryError) as fault:
        raise too_deep(where, f"more than {DEEPEST}") from fault
    except (SyntaxError, ValueError) as fault:
        if "nested" in str(fault):
            raise too_deep(where, f"more than {DEEPEST}") from fault
        raise InputError(
            "an equation cannot be read",
            where=where,
            expected="arithmetic, as in k * (x - y)",
            found=repr(shortened(text)),
        ) from fault
    if (depth := _depth(tree)) > DEEPEST:
        raise too_deep(where, str(depth))
    return tree


def too_deep(where: str, found: str, remedy: str = SPLIT) -> InputError:
    """Return the error for an equation with too many nested operations."""
    return InputError(
        "an equation has too many nested operations",
        where=where,
        expected=f"at most {DEEPEST}, one within the other (a sum of n terms has n - 1)",
        found=found,
        remedy=remedy,
    )


def _depth(tree: ast.Expression) -> int:
    """Return the number of nested operations, without recursion."""
    depth, level = 0, [tree.body]
    while level := [
        child
        for node in level
        for child in ast.iter_child_nodes(node)
        if isinstance(child, ast.expr)
    ]:
        depth += 1
    return depth


def shortened(text: str) -> str:
    """Return the beginning of a faulty part, for a message."""
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."


def _names(tree: ast.AST, known: set[str], where: str) -> Iterable[str]:
    functions = {id(n.func) for n in ast.walk(tree) if isinstance(n, ast.Call)}
    for node in ast.walk(tree):
        if not isinstance(node, ALLOWED):
            raise not_arithmetic_error(shortened(ast.unparse(node) or type(node).__name__), where)
        if isinstance(node, ast.Constant):
            check_number(node.value, where)
        if isinstance(node, ast.Call):
            check_call(node, where)
        if isinstance(node, ast.Name) and id(node) not in functions:
            if node.id not in known:
                raise InputError(
                    f"{shortened(node.id)!r} is not known here",
                    where=where,
                    remedy=nearest(node.id, known),
                )
            yield node.id


def check_number(value: object, where: str) -> None:
    """Raise InputError unless a constant of an equation is a number that a float can hold."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise not_arithmetic_error(repr(value), where)
    if abs(value) > sys.float_info.max:
        raise InputError(
            "a number of an equation is too large",
            where=where,
            expected=f"at most {sys.float_info.max:.3g}",
            remedy="write a smaller number, or use another unit",
        )


def check_call(node: ast.Call, where: str) -> None:
    """Raise InputError unless a call is one of a known function with its number of arguments."""
    name = node.func.id if isinstance(node.func, ast.Name) else ""
    if name not in CALLED or node.keywords or len(node.args) != ARGUMENTS.get(name, 1):
        binary = (*ARGUMENTS, *(n for n, count in OF_VECTORS.items() if count == 2))
        expected = f"{', '.join((*CALLED, *OF_VECTORS))}; {', '.join(binary)} with two arguments"
        raise InputError(
            f"{shortened(ast.unparse(node))!r} may not be called in an equation",
            where=where,
            expected=expected,
        )


def not_arithmetic_error(found: str, where: str) -> InputError:
    """Return the error for a part of an equation that is not arithmetic."""
    return InputError(
        "an equation may hold arithmetic alone",
        where=where,
        found=found,
        expected="numbers, names, + - * / **, comparisons in `a if b > c else d`, and "
        + ", ".join(CALLED),
    )


def _unparsed(tree: ast.AST) -> str:
    return ast.unparse(ast.fix_missing_locations(tree))


def _time_of(node: ast.expr, parameters: Collection[str], where: str) -> str | float:
    """Return the time of a delay: a parameter's name, or a number. Raises InputError."""
    if isinstance(node, ast.Name) and node.id in parameters:
        return node.id
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return float(node.value)
    raise InputError(
        "the time of a delay is a parameter or a number of seconds, not below 0",
        where=where,
        expected=", ".join(parameters) or "a number of seconds",
        found=shortened(ast.unparse(node)),
        remedy="give the time as a parameter under [parameters]",
    )


class _Renamed(ast.NodeTransformer):
    """Add the prefix to quantities and the module to functions; convert numbers to floats.

    delays: delayed quantities found so far; each gets a name.
    """

    def __init__(self, parameters: Collection[str], where: str) -> None:
        self.delays: list[Delay] = []
        self._parameters, self._where = parameters, where

    def visit_Call(self, node: ast.Call) -> ast.AST:
        assert isinstance(node.func, ast.Name)
        if node.func.id == DELAY:
            return self._delay(*node.args)
        arguments = [self.visit(a) for a in node.args]
        function = ast.parse(FUNCTIONS[node.func.id], mode="eval").body
        return ast.Call(function, arguments, [])

    def _delay(self, quantity: ast.expr, time: ast.expr) -> ast.AST:
        delay_time = _time_of(time, self._parameters, self._where)
        self.delays.append(Delay(_unparsed(self.visit(quantity)), delay_time))
        return ast.Name(f"{LATE}{len(self.delays) - 1}", ast.Load())

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return ast.Name(f"{PREFIX}{node.id}", ast.Load())

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        assert isinstance(node.value, (int, float))
        return ast.Constant(float(node.value))
