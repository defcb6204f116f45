"""Which folders below a folder are runs and analyses, and the stamp that shows that one was changed."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.run_folder import DESCRIPTION, FRAMES, TRIAL

INDEX = ".slipbench-index"
IDENTIFICATION, VERDICT, QUICK_LOOK = "identification.json", "verdict.json", "quick_look.json"
PLAN, RUNS = "plan.toml", "runs"  # of the folder of a session
READ = (DESCRIPTION, FRAMES, TRIAL, IDENTIFICATION, VERDICT, QUICK_LOOK)
HERE = "."


@dataclass(frozen=True)
class Folder:
    """A folder that the index has an entry for.

    path     relative to the folder of the index, with "/" between its parts
    kind     run: a recording; identify, explain: results of that command in a folder of their own
    session  path of the session that it belongs to, "." where that is the folder of the index; "" for
             none
    run      path of the run folder in which an analysis lies; "" for none
    stamp    name, time of change in ns and size in bytes of each file that is read
    """

    path: str
    kind: str
    session: str = ""
    run: str = ""
    stamp: tuple[tuple[str, int, int], ...] = ()

    @property
    def changed(self) -> int:
        """Time of the last change of a file, ns since 1970; 0 without any."""
        return max((time for _, time, _ in self.stamp), default=0)


def folders(root: Path) -> list[Folder]:
    """Runs and analyses below `root`, by path. Raises InputError where there is no such folder.

    Links to folders are followed, each folder once; folders with a leading dot are left out. A folder
    that cannot be listed is an entry of kind "unreadable".
    """
    if not root.is_dir():
        raise InputError("there is no such folder", where=str(root), remedy="check the path")
    if _is_run(_items(root)):
        raise InputError(
            "this is a run folder itself",
            where=str(root),
            expected="a folder with runs or sessions in it",
            remedy="give the folder above it",
        )
    return sorted(_walk(root, HERE, "", "", set()), key=lambda one: one.path)


def _walk(
    root: Path, path: str, session: str, run: str, entered: set[tuple[int, int]]
) -> Iterator[Folder]:
    """Entries for a folder and those below it. session, run: in which it lies."""
    try:
        status, items = (root / path).stat(), _items(root / path)
    except OSError:
        yield Folder(path, "unreadable", session)
        return
    if (status.st_dev, status.st_ino) in entered:
        return
    entered.add((status.st_dev, status.st_ino))
    if PLAN in items and RUNS in items:
        session = path
    kinds = _kinds(items)
    for kind in kinds:
        yield Folder(path, kind, session, run, _stamp(root / path))
    if "run" in kinds:
        run = path
    for item in items:
        inner = item if path == HERE else f"{path}/{item}"
        if not item.startswith(".") and (root / inner).is_dir():
            yield from _walk(root, inner, session, run, entered)


def _items(folder: Path) -> list[str]:
    return sorted(item.name for item in folder.iterdir())


def _is_run(items: list[str]) -> bool:
    return DESCRIPTION in items or FRAMES in items


def _kinds(items: list[str]) -> list[str]:
    """Kinds of entry that a folder has, by its files."""
    made = ["run"] if _is_run(items) else []
    if IDENTIFICATION in items and not made:
        made.append("identify")
    if VERDICT in items:
        made.append("explain")
    return made


def _stamp(folder: Path) -> tuple[tuple[str, int, int], ...]:
    found = []
    for name in READ:
        try:
            status = (folder / name).stat()
        except OSError:
            continue
        found.append((name, status.st_mtime_ns, status.st_size))
    return tuple(found)
