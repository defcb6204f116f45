"""Runs by their names, and their tags."""

import difflib
import posixpath
from collections.abc import Sequence
from pathlib import Path

from slipbench.identification.season.folders import Folder, folders
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import DESCRIPTION
from slipbench.protocol.recording.tags import parse_tag, tags_of, write_tags


def tag_runs(root: Path, name: str | None, texts: Sequence[str]) -> list[str]:
    """Write tags into run.toml of runs below `root`; returns a line for each run.

    name: of a run, or of a session, which stands for its runs; texts: KEY=VALUE. All is checked before
    anything is written. Raises InputError for an unknown or ambiguous name, and for what is no tag.
    """
    changes = dict(map(parse_tag, texts))
    if name is None or not changes:
        raise InputError(
            "a tag needs a run and at least one KEY=VALUE",
            where="--tag",
            found=" ".join(texts) or "no KEY=VALUE",
            remedy="slipbench runs FOLDER --tag RUN tyre=new mileage=812",
        )
    paths = _runs_called(name, [one for one in folders(root) if one.kind == "run"])
    for path in paths:
        tags_of(load_toml(root / path / DESCRIPTION), str(root / path / DESCRIPTION))
    for path in paths:
        write_tags(root / path, changes)
    said = ", ".join(
        f"{key} removed" if value is None else f"{key} = {value}" for key, value in changes.items()
    )
    return [f"{path}: {said}" for path in paths]


def _runs_called(name: str, runs: Sequence[Folder]) -> list[str]:
    """Paths of the runs of a session, or of the one run of this name."""
    session = [one.path for one in runs if name and one.session == posixpath.normpath(name)]
    return session or [one_called(name, [run.path for run in runs])]


def one_called(name: str, paths: Sequence[str]) -> str:
    """The one path that is, or ends with, a name. Raises InputError where it is none or several.

    "sweep-1", "monday/sweep-1" and "monday/runs/sweep-1" may all mean the last of these.
    """
    parts = [part for part in posixpath.normpath(name).split("/") if part]
    exact = [path for path in paths if path == "/".join(parts)]
    found = exact or [path for path in paths if _means(parts, path.split("/"))]
    if len(found) == 1:
        return found[0]
    if found:
        raise InputError(
            f"several runs are called {name!r}",
            found=", ".join(found),
            remedy="name the session as well, or the whole path",
        )
    known = {posixpath.basename(path): path for path in paths}
    near = difflib.get_close_matches(parts[-1] if parts else "", known, n=1, cutoff=0.4)
    remedy = f"did you mean {near[0]!r}?" if near else "slipbench runs FOLDER lists the names"
    raise InputError(f"there is no run {name!r}", remedy=remedy)


def _means(parts: Sequence[str], path: Sequence[str]) -> bool:
    """Whether a path ends with the last part and has the others before it, in this order."""
    if not parts or parts[-1] != path[-1]:
        return False
    rest = iter(path[:-1])
    return all(part in rest for part in parts[:-1])
