"""Files that ship with slipbench, found by name where a command or a file expects a path.

`slipbench trial throttle_sweep` runs examples/trials/throttle_sweep.toml. A path that exists is
taken first; a path with a suffix or a folder is never replaced by a shipped file, only named in
the remedy, so that a mistyped path cannot start a trial that the user did not choose.
"""

from collections.abc import Callable
from contextlib import suppress
from importlib.resources import files
from pathlib import Path

from slipbench.protocol.errors import InputError

PACKAGE = Path(str(files("slipbench")))
PATTERNS = {
    "trial": ("examples/trials/*.toml",),
    "vehicle": ("plant/vehicles/*.toml",),
    "controller": ("examples/controllers/*.toml",),
    "model": ("examples/models/*.toml",),
    "role map": ("examples/roles/*.toml", "dbc/*_roles.toml"),
    "binding": ("examples/bindings/*.toml", "dbc/*_roles.toml"),
    "database": ("dbc/*.dbc", "examples/bindings/*.dbc"),
}


def shipped_files(*kinds: str) -> dict[str, Path]:
    """Return name and path of the files of some kinds (keys of PATTERNS) that ship with slipbench."""
    patterns = [pattern for kind in kinds for pattern in PATTERNS[kind]]
    found = sorted(path for pattern in patterns for path in PACKAGE.glob(pattern))
    return {path.stem: path for path in found}


def file_or_shipped(name: str | Path, *kinds: str, folder: Path = Path()) -> Path:
    """Return the path of a file: `name`, relative to `folder`, else the shipped file of that name.

    A missing path with a suffix is returned as it is: whoever reads it reports it. Raises
    InputError where a name is unknown, or where a missing path has the name of a shipped file.
    """
    path, text, known = folder / name, str(name), shipped_files(*kinds)
    if _exists(path):
        return path
    if text in known:
        return known[text]
    if (stem := Path(text).stem) in known:
        raise InputError(
            "no such file",
            where=str(path),
            remedy=f"check the path; to use the file that ships with slipbench, write {stem}",
        )
    if text and text.isprintable() and Path(text).name == text and not Path(text).suffix:
        raise InputError(
            f"no such file, and slipbench ships no {' or '.join(kinds)} of this name",
            where=text[:200],
            expected="a path, or one of " + ", ".join(known),
            remedy="check the spelling",
        )
    return path


def is_shipped(path: Path) -> bool:
    """Return whether a file is one of the package's own, beside which nothing may be written."""
    own = (
        one.resolve()
        for patterns in PATTERNS.values()
        for pattern in patterns
        for one in PACKAGE.glob(pattern)
    )
    return path.resolve() in own


def file_of(*kinds: str) -> Callable[[str], Path]:
    """Return the parser of a command's parameter that takes a path or a shipped file's name."""

    def file(value: str) -> Path:
        return file_or_shipped(value, *kinds)

    return file


def completion_of(*kinds: str) -> Callable[[str], list[str]]:
    """Return the shell completion of such a parameter: local paths and shipped names."""

    def complete(incomplete: str) -> list[str]:
        start = Path(incomplete)
        folder = start if incomplete.endswith("/") else start.parent
        paths = sorted(folder.iterdir()) if folder.is_dir() else []
        local = [f"{path}/" if path.is_dir() else str(path) for path in paths]
        return [one for one in (*local, *shipped_files(*kinds)) if one.startswith(incomplete)]

    return complete


def _exists(path: Path) -> bool:
    with suppress(OSError, ValueError):  # a name too long, or one with a NUL
        return path.exists()
    return False
