"""What a public function's docstring must state, checked on the source text.

Public: a function of a module, or a method of a public class, whose name has no leading underscore.

1. A function that takes or returns a numpy array states a shape or a unit: the word "shape", a shape
   such as `(n,)` or `(n, 2)`, or a unit. A unit of one letter, or one that is also a word,
   counts only where a unit is expected, as in "in s", "t: s", "(m)", "3 s".
2. A function that raises an exception itself says "Raises" and names the exception.
   `NotImplementedError`, `AssertionError` and the exit of a command are not errors of the caller.

A method without a docstring has that of the method that it overrides.

Run `python -m tests.docstring_rules [DIRECTORY...]` for the counts and what is missing.
"""

import ast
import functools
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from tests.paths import ROOT

PACKAGES = ("bench", "protocol", "plant", "controllers", "identification", "studies")
LEFT_OUT: tuple[str, ...] = ()

LONG_UNITS = (
    r"bit/s|rad|deg|Hz|kHz|MHz|kg|kPa|Pa|ms|us|µs|ns|km|mm|kW|dB|nats|degC|ppm|percent|radians|SI"
    r"|dimensionless"
)
SHORT_UNITS = (  # and words that are units only where a unit is expected
    r"s|m|N|V|A|K|W|J|g|C|bar|bits|bit|bytes|ticks|counts|samples|frames|teeth|revolutions|turns"
)
NOT_ERRORS = {"NotImplementedError", "AssertionError", "Exit"}

_POWER = r"(?:[²³]|\^-?\d|\*\*-?\d)?"
_ANY = f"(?:{LONG_UNITS}|{SHORT_UNITS})"
_EXPECTED = r"(?:\b(?:in|Returns|returns|or|per) |: |, |\(|\[|\d )"
SHAPE = re.compile(
    r"\bshapes?\b|\((?:[A-Za-z0-9]{1,2}|[0-9a-z]+ [-+*] [0-9a-z]+)?, ?[\w +*-]*(?:, ?\w+)*\)"
)
UNIT = re.compile(
    rf"(?<![\w'’`/])(?:{LONG_UNITS}){_POWER}(?![\w`])"  # a unit that is no other word
    rf"|(?<![\w'’])(?:1|{_ANY}){_POWER}(?: ?/ ?\(?){_ANY}{_POWER}(?![\w`])|\bN[ ·]m\b"  # rad/s, 1/s, N m
    rf"|{_EXPECTED}(?:{SHORT_UNITS}){_POWER}(?![\w'’`-])"
    r"|%|\b(?:no|without) units?\b|\bunits? of\b|: 1[,.;)]"
)


@dataclass(frozen=True)
class Function:
    """A public function and what its docstring lacks."""

    path: str
    line: int
    name: str
    arrays: bool
    raises: frozenset[str]
    docstring: str

    def states_shape_or_unit(self) -> bool:
        return bool(SHAPE.search(self.docstring) or UNIT.search(self.docstring))

    def missing_errors(self) -> list[str]:
        """Names of the exceptions that it raises and does not state."""
        if not re.search(r"\b[Rr]aises?\b", self.docstring):
            return sorted(self.raises)
        return sorted(n for n in self.raises if n[0].isupper() and n not in self.docstring)

    def faults(self) -> list[str]:
        where = f"{self.path}:{self.line} {self.name}"
        found = []
        if self.arrays and not self.states_shape_or_unit():
            found.append(f"{where}: states neither shape nor unit")
        if missing := self.missing_errors():
            found.append(f"{where}: does not say that it raises {', '.join(missing)}")
        return found


@dataclass
class Module:
    """A module's tree and the names that stand for arrays in it."""

    path: str
    tree: ast.Module
    aliases: set[str] = field(default_factory=set)


def faults(root: Path, *under: str) -> list[str]:
    """Faults of every public function in these directories."""
    return [fault for function in functions(root, *under) for fault in function.faults()]


def functions(root: Path, *under: str) -> Iterator[Function]:
    """Every public function in these directories, in order of path and line."""
    modules = _modules(root)
    classes = {
        node.name: node
        for module in modules
        for node in ast.walk(module.tree)
        if isinstance(node, ast.ClassDef)
    }
    for module in modules:
        if any(module.path == part or module.path.startswith(f"{part}/") for part in under):
            yield from _public(module, classes)


@functools.cache
def _modules(root: Path) -> list[Module]:
    paths = sorted(path for part in PACKAGES for path in (root / part).rglob("*.py"))
    paths += sorted((root / "src" / "slipbench").glob("*.py"))
    modules = [
        Module(path.relative_to(root).as_posix(), ast.parse(path.read_text(encoding="utf-8")))
        for path in paths
        if not path.relative_to(root).as_posix().startswith(LEFT_OUT)
    ]
    exported: set[tuple[str, str]] = set()
    for _ in range(3):  # an alias of an alias, and one that is imported through another module
        for module in modules:
            _find_aliases(module, exported)
    return modules


def _find_aliases(module: Module, exported: set[tuple[str, str]]) -> None:
    """Note the names that stand for arrays: defined here, or imported from where they are."""
    here = "slipbench." + module.path.removesuffix(".py").removesuffix("/__init__").replace(
        "/", "."
    )
    for node in ast.walk(module.tree):
        if isinstance(node, ast.ImportFrom):
            module.aliases |= {
                name.asname or name.name
                for name in node.names
                if (node.module or "", name.name) in exported
            }
    for node in module.tree.body:
        if isinstance(node, ast.Assign) and not isinstance(node.value, ast.Call):
            target = node.targets[0]
            if isinstance(target, ast.Name) and _is_array(node.value, module.aliases):
                module.aliases.add(target.id)
    exported |= {(here, name) for name in module.aliases}


def _public(module: Module, classes: dict[str, ast.ClassDef]) -> Iterator[Function]:
    for node in module.tree.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield from _function(module, node, node.name, ast.get_docstring(node) or "")
        elif isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            for method in node.body:
                if isinstance(method, ast.FunctionDef | ast.AsyncFunctionDef):
                    text = _inherited(node, method.name, classes)
                    yield from _function(module, method, f"{node.name}.{method.name}", text)


def _function(
    module: Module, node: ast.FunctionDef | ast.AsyncFunctionDef, name: str, docstring: str
) -> Iterator[Function]:
    if node.name.startswith("_") or any(_last_name(d) == "overload" for d in node.decorator_list):
        return
    arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    annotations = [argument.annotation for argument in arguments] + [node.returns]
    arrays = any(_is_array(part, module.aliases) for part in annotations if part is not None)
    raises = frozenset(_raised(node)) - NOT_ERRORS
    yield Function(module.path, node.lineno, name, arrays, raises, " ".join(docstring.split()))


def _inherited(
    owner: ast.ClassDef, name: str, classes: dict[str, ast.ClassDef], depth: int = 0
) -> str:
    """Docstring of a method, or of the one that it overrides."""
    own = [node for node in owner.body if getattr(node, "name", "") == name]
    for node in own:
        if isinstance(node, ast.FunctionDef) and (text := ast.get_docstring(node)):
            return text
    bases = [
        classes[base] for base in map(_last_name, owner.bases) if base in classes and depth < 5
    ]
    return next(filter(None, (_inherited(base, name, classes, depth + 1) for base in bases)), "")


def _is_array(annotation: ast.expr, aliases: set[str]) -> bool:
    words = set(re.findall(r"[A-Za-z_]\w*", ast.unparse(annotation)))
    return bool(words & ({"ndarray", "NDArray", "ArrayLike"} | aliases))


def _raised(node: ast.AST) -> Iterator[str]:
    """Names of what the function itself raises; functions inside it are not its own."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef):
            continue
        if isinstance(child, ast.Raise) and child.exc is not None:
            yield _last_name(child.exc)
        yield from _raised(child)


def _last_name(node: ast.expr) -> str:
    if isinstance(node, ast.Call | ast.Subscript):
        return _last_name(node.func if isinstance(node, ast.Call) else node.value)
    return node.attr if isinstance(node, ast.Attribute) else getattr(node, "id", "error")


def counts(root: Path, directory: str) -> str:
    """A line of counts for one directory."""
    every = list(functions(root, directory))
    arrays = [f for f in every if f.arrays]
    raising = [f for f in every if f.raises]
    stated = sum(f.states_shape_or_unit() for f in arrays)
    said = sum(not f.missing_errors() for f in raising)
    return (
        f"{directory:<34} {len(every):5} public   arrays {stated:4} of {len(arrays):4}   "
        f"raises {said:4} of {len(raising):4}"
    )


def directories(root: Path) -> list[str]:
    """Every directory that holds modules: two levels of the packages."""
    found = []
    for package in PACKAGES:
        inner = [
            f"{package}/{path.name}" for path in sorted((root / package).iterdir()) if path.is_dir()
        ]
        found += [package, *(i for i in inner if i not in LEFT_OUT and "__" not in i)]
    return found


def main(under: list[str]) -> None:
    """Print the counts, and what is missing in the directories that are named."""
    for directory in under or directories(ROOT):
        print(counts(ROOT, directory))
    for fault in faults(ROOT, *under):
        print(fault)


if __name__ == "__main__":
    main(sys.argv[1:])
