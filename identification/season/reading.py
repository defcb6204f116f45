"""Entries of folders, each from its own files alone: here, or by the workers of a dask cluster."""

import socket
from collections.abc import Sequence
from pathlib import Path

from slipbench.identification.cluster import Workers, done_by
from slipbench.identification.season.entry import Entry
from slipbench.identification.season.explained import with_verdict
from slipbench.identification.season.folders import IDENTIFICATION, Folder
from slipbench.identification.season.identified import with_identification
from slipbench.identification.season.run_entry import in_one_line, run_entry
from slipbench.protocol.errors import InputError

AT_ONCE = 32  # folders of one job: reading one takes milliseconds


def entry_of(root: Path, folder: Folder) -> Entry:
    """Entry of a folder below `root`. What cannot be read is a fault of the entry."""
    try:
        match folder.kind:
            case "run":
                return run_entry(root, folder)
            case "identify":
                return with_identification(Entry(folder), root / folder.path / IDENTIFICATION)
            case "explain":
                return with_verdict(Entry(folder), root / folder.path)
    except InputError as fault:
        return Entry(folder).with_faults(in_one_line(fault, root))
    return Entry(folder).with_faults("the folder cannot be listed")


def read_entries(root: Path, found: Sequence[Folder], scheduler: str | None = None) -> list[Entry]:
    """Entries of folders below `root`, in their order.

    scheduler: address of a dask cluster, whose workers read the folders at the same path. Raises
    InputError where it does not respond, or a worker does not have the folder.
    """
    if scheduler is None:
        return [entry_of(root, folder) for folder in found]
    parts = [tuple(found[i : i + AT_ONCE]) for i in range(0, len(found), AT_ONCE)]
    jobs = {f"folders-{i}": (str(root.resolve()), part) for i, part in enumerate(parts)}
    done = dict(done_by(Workers(scheduler=scheduler), _read_part, jobs))
    return [entry for name in jobs for entry in done[name]]


def _read_part(root: str, part: Sequence[Folder]) -> list[Entry]:
    place = Path(root)
    if not place.is_dir():
        raise InputError(
            "a worker of the cluster does not have this folder",
            where=root,
            found=f"worker on {socket.gethostname()}",
            remedy="give every worker access to it at this path, or leave out --scheduler",
        )
    return [entry_of(place, folder) for folder in part]
