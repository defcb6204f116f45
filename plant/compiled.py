"""Machine code for generated text, kept on disk so that no text is compiled twice.

The text goes into a file whose name is its fingerprint, in a cache folder; numba keeps the machine
code beside it. The file appears by an atomic rename and a lock lets one process compile while the
others wait. The folder is `$SLIPBENCH_CACHE`, else `slipbench` in the user's cache folder.
"""

import ast
import fcntl
import hashlib
import importlib.util
import inspect
import os
import platform
import sys
import tempfile
import textwrap
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, wraps
from pathlib import Path
from types import ModuleType
from typing import Any

import numba
import numpy as np

HEADER = """import math

import numpy as np
from numba import njit
"""


def cache_folder() -> Path:
    """Folder for compiled kernels; it is made where it is missing.

    Raises OSError where it cannot be made.
    """
    default = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "slipbench"
    folder = Path(os.environ.get("SLIPBENCH_CACHE") or default)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as trouble:
        raise OSError(
            f"cache folder {folder} cannot be made ({trouble.strerror}); "
            "set SLIPBENCH_CACHE to a folder that can be written"
        ) from trouble
    return folder


def text_of(function: Callable[..., Any], name: str | None = None) -> str:
    """A function's text, bare of docstring and annotations, under another name if given."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    assert isinstance(tree, ast.FunctionDef), f"{function!r} is not a plain function"
    if ast.get_docstring(tree) is not None:
        tree.body = tree.body[1:]
    for argument in tree.args.args:
        argument.annotation = None
    tree.returns = None
    tree.decorator_list = []
    tree.name = name or tree.name
    return ast.unparse(tree)


FLAGS = "error_model='numpy', fastmath={'arcp', 'contract'}"
"""Divisions by constants may become products, products with sums may fuse; NaN stays NaN."""


INNER = f"{FLAGS}, no_cpython_wrapper=True, no_cfunc_wrapper=True, _nrt=False"
"""Of functions that only the kernel calls: nothing is made for Python, and arrays that are handed on
are not counted, which would cost more than what is done with them. They cannot make arrays."""


_ONE_AT_A_TIME = threading.RLock()


def made_once(make: Callable[..., ModuleType]) -> Callable[..., ModuleType]:
    """A function that makes a module from text, kept for its arguments, by one thread at a time.

    Threads that parse Python at once disturb each other's parser in Python 3.11 (SystemError: "AST
    constructor recursion depth mismatch", python/cpython issue 106905).
    """
    kept = cache(make)

    @wraps(make)
    def made(*arguments: Any) -> ModuleType:
        with _ONE_AT_A_TIME:
            return kept(*arguments)

    return made


def inlined(text: str, signature: str = "") -> str:
    """The text of a function that the compiler merges into its callers.

    signature: the only one; else the function is compiled for each that calls have. To numba, each whole
    number that is written in a call is a type of its own. A function with a signature is compiled when
    its module is loaded, therefore it is kept.
    """
    only = f"{signature!r}, " if signature else ""
    kept = ", cache=True" if signature else ""
    return f"@njit({only}forceinline=True, {INNER}{kept})\n{text}\n"


def plain(text: str) -> str:
    """The text of a function that the kernel calls, compiled apart from its callers."""
    return f"@njit({INNER})\n{text}\n"


def entry(text: str, signature: str) -> str:
    """The text of a function that Python calls, compiled for one signature and kept.

    Other threads run while it does.
    """
    return f"@njit({signature!r}, {FLAGS}, cache=True, nogil=True)\n{text}\n"


NUMBERS = {
    "i8": numba.int64,
    "f8": numba.float64,
    "f8[::1]": numba.float64[::1],
    "f8[:,::1]": numba.float64[:, ::1],
    "f8[:,:,::1]": numba.float64[:, :, ::1],
}
Told = str | np.dtype[Any] | Sequence[np.dtype[Any]]
"""A type: as numba writes it, a record, or in a list of one an array of records."""


def signature(result: Told, *arguments: Told) -> Any:
    """Return a signature that may contain records."""
    return _type(result)(*map(_type, arguments))


def _type(type_spec: Told) -> Any:
    if isinstance(type_spec, str):
        return NUMBERS[type_spec]
    if isinstance(type_spec, np.dtype):
        return numba.from_dtype(type_spec)
    return numba.types.Array(numba.from_dtype(type_spec[0]), 1, "C")


UNSIGNED = "unsigned"
"""Part of the fingerprint: code whose indices have a sign is not taken from the cache."""


def unsigned(text: str) -> str:
    """The text with indices that have no sign.

    Kernels do not index from the end of an array. To a signed index numba adds a test for that, which
    keeps the compiler from vectorizing loops: sensitivities then take twice the time.
    """
    return ast.unparse(_Unsigned().visit(ast.parse(text)))


class _Unsigned(ast.NodeTransformer):
    def visit_Subscript(self, node: ast.Subscript) -> ast.Subscript:
        self.generic_visit(node)
        if isinstance(node.slice, ast.Tuple):
            node.slice.elts = [_without_sign(index) for index in node.slice.elts]
        else:
            node.slice = _without_sign(node.slice)
        return node


def _without_sign(index: ast.expr) -> ast.expr:
    if isinstance(index, ast.Slice | ast.Constant):
        return index
    return ast.parse(f"np.uint64({ast.unparse(index)})", mode="eval").body


def load(text: str) -> ModuleType:
    """The module that the text makes, from the cache if it was compiled before."""
    made_by = f"{numba.__version__} {platform.python_version()} {platform.machine()} {UNSIGNED}"
    fingerprint = hashlib.sha256(f"{made_by}\n{text}".encode()).hexdigest()[:20]
    name = f"slipbench_{fingerprint}"
    folder = cache_folder()
    with _only_one(folder / f"{name}.lock"):  # other threads wait here as well
        if name in sys.modules:
            return sys.modules[name]
        path = folder / f"{name}.py"
        if not path.exists():
            _write(path, HEADER + unsigned(text))
        return _import(name, path)


def _write(path: Path, text: str) -> None:
    handle, temporary = tempfile.mkstemp(dir=path.parent, suffix=".tmp")
    with os.fdopen(handle, "w") as file:
        file.write(text)
    Path(temporary).replace(path)


def _import(name: str, path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # before its code runs: numba asks for it by name
    try:
        spec.loader.exec_module(module)
    except BaseException:
        del sys.modules[name]
        raise
    return module


@contextmanager
def _only_one(path: Path) -> Iterator[None]:
    with path.open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
