"""What a mutant of mutmut changed: one statement of one function, before and after.

mutmut numbers its mutants, and the numbers move whenever a function is edited. A change is named by
what it does instead, so that a list of accepted ones outlives edits elsewhere.
"""

import ast
import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

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
    """Whether the change touches nothing but what a raised error says."""
    kinds = [_raised(text) for text in (change.before, change.after)]
    return kinds[0] is not None and kinds[0] == kinds[1]


def _raised(text: str) -> str | None:
    """The error of a raise statement, without its arguments; None where it is another statement."""
    try:
        body = ast.parse(text).body
    except SyntaxError:
        return None
    if len(body) != 1 or not isinstance(body[0], ast.Raise):
        return None
    error = body[0].exc
    return ast.unparse(error.func if isinstance(error, ast.Call) else error) if error else None
