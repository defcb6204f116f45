"""What a mutant of mutmut changed: one statement of one function, before and after.

mutmut numbers its mutants, and the numbers move whenever a function is edited. A change is named by
what it does instead, so that a list of accepted ones outlives edits elsewhere.
"""

import ast
import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

WORDS = frozenset({"expected", "found", "remedy", "where"})
Function = ast.FunctionDef | ast.AsyncFunctionDef


class Change(NamedTuple):
    """function: module.Class.name; before, after: the changed lines as `ast.unparse` writes them."""

    function: str
    before: str
    after: str

    def __str__(self) -> str:
        """Return the change as an entry of tests/mutants.toml."""
        return f"  {self.function}\n  - {self.before}\n  + {self.after}"


def changes_of(file: Path, mutants: Iterable[str]) -> dict[str, Change]:
    """The change of each named mutant. file: as mutmut wrote it, every mutant inside."""
    functions = {
        node.name: node
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8")))
        if isinstance(node, Function)
    }
    return {mutant: _change(functions, mutant) for mutant in mutants}


def _change(functions: dict[str, Function], mutant: str) -> Change:
    module, _, name = mutant.rpartition(".")
    base = name.rpartition("__mutmut_")[0]
    before, after = (_lines(functions[it]) for it in (f"{base}__mutmut_orig", name))
    lines = list(difflib.ndiff(before, after))
    gone = [line[2:].strip() for line in lines if line.startswith("- ")]
    new = [line[2:].strip() for line in lines if line.startswith("+ ")]
    plain = base.removeprefix("xǁ").removeprefix("x_").replace("ǁ", ".")
    function = f"{module.removeprefix('slipbench.')}.{plain}"
    return Change(function, "\n".join(gone), "\n".join(new))


def _lines(function: Function) -> list[str]:
    """Signature and body, one statement a line, without the name that mutmut gave it."""
    return [
        f"def ({ast.unparse(function.args)})",
        *ast.unparse(ast.Module(function.body, [])).splitlines(),
    ]


def only_wording(change: Change) -> bool:
    """Whether the change touches nothing but words for people, or an internal check.

    Words: the arguments of a raised error, arguments named expected, found, remedy or where, and
    any text with a space in it, which no name of the program has. An internal check: `strict` of zip, where both lengths follow from the code.
    """
    before, after = _parsed(change.before), _parsed(change.after)
    if before is None or after is None:
        return False
    return ast.dump(_WithoutWords().visit(before)) == ast.dump(_WithoutWords().visit(after))


def _parsed(text: str) -> ast.Module | None:
    """Statements; the head of a loop or a condition gets a body. None for what is neither."""
    for candidate in (text, f"{text} pass", f"{text.removeprefix('el')} pass"):
        try:
            return ast.parse(candidate)
        except SyntaxError:
            continue
    return None


class _WithoutWords(ast.NodeTransformer):
    """Leaves out what `only_wording` does not count."""

    def visit_Raise(self, node: ast.Raise) -> ast.AST:
        """Keep the class of the error."""
        if isinstance(node.exc, ast.Call):
            node.exc = node.exc.func
        return node

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        """Keep names; empty phrases."""
        if isinstance(node.value, str) and " " in node.value:
            node.value = ""
        return node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        """Keep all arguments but words and checks."""
        self.generic_visit(node)
        drop = {"strict"} if ast.unparse(node.func) == "zip" else WORDS
        node.keywords = [each for each in node.keywords if each.arg not in drop]
        return node
