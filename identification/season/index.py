"""The index of a folder: kept beside the runs as Parquet, read again only where a folder changed.

    FOLDER/.slipbench-index/entries.parquet   one row for each run and each analysis

A folder is unchanged where each file that is read has the same size and time of change. A file that
was changed within SETTLED before the index was written is read again, since a second change at the
same moment would leave no trace.
"""

import os
from collections.abc import Callable
from pathlib import Path

from slipbench.identification.season.columns import VERSION, entries_of, table_of
from slipbench.identification.season.entry import Entry
from slipbench.identification.season.folders import INDEX, Folder, folders
from slipbench.identification.season.reading import read_entries
from slipbench.protocol.extras import optional_library

FILE = "entries.parquet"
SETTLED = 2_000_000_000  # ns: the coarsest time of change of a file system (FAT)
Say = Callable[[str], None]


def refreshed(root: Path, scheduler: str | None = None, say: Say = lambda _: None) -> list[Entry]:
    """Entries of every run and analysis below `root`, by path; the index is brought up to date.

    scheduler: of a dask cluster that reads what changed. say: receives why the index was made anew, or
    could not be written; the entries are the same then. Raises InputError where there is no such
    folder, pyarrow is missing, or the cluster does not do its part.
    """
    optional_library("pyarrow")
    found, known = folders(root), _known(root / INDEX / FILE, say)
    changed = [one for one in found if one not in known]
    read = {e.folder: e for e in read_entries(root, changed, scheduler)}
    entries = [read.get(one) or known[one] for one in found]
    if changed or len(entries) != len(known):
        _write(entries, root / INDEX, say)
    return entries


def _known(path: Path, say: Say) -> dict[Folder, Entry]:
    """Entries of the index that can be relied on, by folder with its stamp; none where it is damaged."""
    pa, parquet = optional_library("pyarrow"), optional_library("pyarrow.parquet")
    if not path.exists():
        return {}
    try:
        table = parquet.read_table(path)
        if (table.schema.metadata or {}).get(b"version") != VERSION.encode():
            say("the index is of another version of slipbench: it is made anew")
            return {}
        entries, written = entries_of(table), path.stat().st_mtime_ns
    except (pa.ArrowException, OSError, KeyError, TypeError, ValueError) as fault:
        say(f"the index is damaged ({str(fault).splitlines()[0]}): it is made anew")
        return {}
    return {e.folder: e for e in entries if e.folder.changed < written - SETTLED}


def _write(entries: list[Entry], place: Path, say: Say) -> None:
    """Write the index, whole or not at all."""
    parquet = optional_library("pyarrow.parquet")
    draft = place / f"{FILE}.{os.getpid()}.part"
    try:
        place.mkdir(exist_ok=True)
        parquet.write_table(table_of(entries), draft)
        draft.replace(place / FILE)
    except OSError as fault:
        say(f"the index cannot be kept ({fault.strerror or fault}): it is made anew each time")
