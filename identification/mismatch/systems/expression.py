"""Equations are text in a model file; here they are read, and nothing but arithmetic passes.

The text goes through Python's own parser and every node is held against a list. What passes becomes
the text of a compiled kernel; nothing is ever evaluated as it stands.
"""

import ast
import sys
from collections.abc import Iterable
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
ARGUMENTS = {"atan2": 2, "min": 2, "max": 2}
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
LONGEST = 1000
"""Characters of an equation."""
SHOWN = 60
"""Characters of a faulty part that a message repeats."""
DEEPEST = 100
"""Nested operations of an equation; the sum of 100 terms has as many."""


@dataclass(frozen=True)
class Expression:
    """text: as it stands in a kernel, every name with a prefix; names: that it uses."""

    text: str
    names: frozenset[str]


def read_expression(text: str, known: Iterable[str], where: str) -> Expression:
    """Read one equation. known: names that may stand in it. Raises InputError."""
    tree = parsed(text, where)
    names = frozenset(_names(tree, set(known), where))
    renamed = _Renamed().visit(tree)
    return Expression(ast.unparse(ast.fix_missing_locations(renamed)), names)


def parsed(text: str, where: str) -> ast.Expression:
    """Return the syntax tree of an equation. Raises InputError where it is none, or too large."""
    split = "split the equation into seams"
    if len(text) > LONGEST:
        raise InputError(
            "an equation is too long",
            where=where,
            expected=f"at most {LONGEST} characters",
            found=f"{len(text)} characters",
            remedy=split,
        )
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (RecursionError, MemoryError) as fault:
        raise _too_deep(where, f"more than {DEEPEST}", split) from fault
    except (SyntaxError, ValueError) as fault:
        if "nested" in str(fault):
            raise _too_deep(where, f"more than {DEEPEST}", split) from fault
        raise InputError(
            "an equation cannot be read",
            where=where,
            expected="arithmetic, as in k * (x - y)",
            found=repr(_shortened(text)),
        ) from fault
    if (depth := _depth(tree)) > DEEPEST:
        raise _too_deep(where, str(depth), split)
    return tree


def _too_deep(where: str, found: str, remedy: str) -> InputError:
    return InputError(
        "an equation has too many nested operations",
        where=where,
        expected=f"at most {DEEPEST}, one within the other (a sum of n terms has n - 1)",
        found=found,
        remedy=remedy,
    )


def _depth(tree: ast.Expression) -> int:
    """Number of operations one within the other, without recursion."""
    depth, level = 0, [tree.body]
    while level := [
        child
        for node in level
        for child in ast.iter_child_nodes(node)
        if isinstance(child, ast.expr)
    ]:
        depth += 1
    return depth


def _shortened(text: str) -> str:
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."


def _names(tree: ast.AST, known: set[str], where: str) -> Iterable[str]:
    functions = {id(n.func) for n in ast.walk(tree) if isinstance(n, ast.Call)}
    for node in ast.walk(tree):
        if not isinstance(node, ALLOWED):
            raise _refused(_shortened(ast.unparse(node) or type(node).__name__), where)
        if isinstance(node, ast.Constant):
            _check_number(node.value, where)
        if isinstance(node, ast.Call):
            _check_call(node, where)
        if isinstance(node, ast.Name) and id(node) not in functions:
            if node.id not in known:
                raise InputError(
                    f"{_shortened(node.id)!r} is not known here",
                    where=where,
                    remedy=nearest(node.id, known),
                )
            yield node.id


def _check_number(value: object, where: str) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise _refused(repr(value), where)
    if abs(value) > sys.float_info.max:
        raise InputError(
            "a number of an equation is too large",
            where=where,
            expected=f"at most {sys.float_info.max:.3g}",
            remedy="write a smaller number, or use another unit",
        )


def _check_call(node: ast.Call, where: str) -> None:
    name = node.func.id if isinstance(node.func, ast.Name) else ""
    if name not in FUNCTIONS or node.keywords or len(node.args) != ARGUMENTS.get(name, 1):
        expected = f"{', '.join(FUNCTIONS)}; {', '.join(ARGUMENTS)} with two arguments"
        raise InputError(
            f"{_shortened(ast.unparse(node))!r} may not be called in an equation",
            where=where,
            expected=expected,
        )


def _refused(found: str, where: str) -> InputError:
    return InputError(
        "an equation may hold arithmetic alone",
        where=where,
        found=found,
        expected="numbers, names, + - * / **, comparisons in `a if b > c else d`, and "
        + ", ".join(FUNCTIONS),
    )


class _Renamed(ast.NodeTransformer):
    """Puts the prefix before quantities and the module before functions; numbers become floats."""

    def visit_Call(self, node: ast.Call) -> ast.AST:
        assert isinstance(node.func, ast.Name)
        arguments = [self.visit(a) for a in node.args]
        function = ast.parse(FUNCTIONS[node.func.id], mode="eval").body
        return ast.Call(function, arguments, [])

    def visit_Name(self, node: ast.Name) -> ast.AST:
        return ast.Name(f"{PREFIX}{node.id}", ast.Load())

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        assert isinstance(node.value, (int, float))
        return ast.Constant(float(node.value))
