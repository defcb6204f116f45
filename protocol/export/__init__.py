"""Export a recording in the formats that other programs read.

It is read, decoded and written in portions, so that memory does not grow with its length. Each is
in order of time; a step back in time from one to the next gives a warning.

    mf4      ASAM MDF 4: raw frames as a bus log, and every signal decoded, a group a message
    blf      Vector BLF: raw frames
    asc      Vector ASC: raw frames
    parquet  a folder of tables: frames.parquet, and one a message
    mcap     raw frames a topic a bus, and decoded messages a topic each, as JSON with a JSON Schema

Vector's two formats have no place for decoded signals: there the database stands beside the log.
"""

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from slipbench.protocol.configuration import read_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database, any_bus
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import Progress, quiet
from slipbench.protocol.logs.candump import candump_pieces, parse_portions
from slipbench.protocol.logs.decode import SortedLog, sort_log
from slipbench.protocol.logs.decode_file import AT_ONCE, Tally
from slipbench.protocol.logs.frame_log import FrameLog
from slipbench.protocol.new_file import new_file, refuse_existing
from slipbench.protocol.recording.database_copy import find_database
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.recording.run_folder import FRAMES, ROLES

ENDINGS = {"mf4": ".mf4", "blf": ".blf", "asc": ".asc", "parquet": "", "mcap": ".mcap"}
MOST_BUSES = 255  # as many as a byte can number


@dataclass(frozen=True)
class Exported:
    """Result of an export. frames: raw ones; samples: decoded values, 0 where the format has none."""

    path: Path
    frames: int
    samples: int
    warnings: tuple[str, ...]


def export_run(
    folder: Path,
    form: str,
    out: Path | None = None,
    progress: Progress = quiet,
    at_once: float = AT_ONCE,
) -> Exported:
    """Write the recording in `folder` in the format `form`, a key of ENDINGS; `out` must be new.

    Where `out` is None, beside the frames; `at_once` frames or a few more are in memory. Raises
    InputError naming what cannot be used; nothing is left behind then, and nothing is ever
    overwritten.
    """
    write = _writers().get(form)
    if write is None:
        raise InputError(f"no format {form!r}", expected=", ".join(ENDINGS), found=form)
    target = out or folder / ("export" + ENDINGS[form])
    refuse_existing(target)
    warnings: list[str] = []
    tally = Tally()
    portions, database = _read(folder, warnings, progress, at_once)
    with new_file(target) as draft:
        samples = write(tally.of(portions), database, draft)
    warnings += [f"{count} {kind} are omitted" for kind, count in tally.skipped.items()]
    return Exported(target, tally.frames, samples, tuple(warnings))


def _read(
    folder: Path, warnings: list[str], progress: Progress, at_once: float
) -> tuple[Iterator[SortedLog], Database]:
    """Portions of frames sorted by message, and the database. Raises InputError without frames."""
    path = folder / FRAMES
    if not os.path.lexists(path):
        raise InputError(
            "there are no raw frames to export",
            where=str(folder),
            expected=FRAMES,
            remedy="give the folder of a recording; one of tables alone is read as it stands",
        )
    roles = folder / ROLES
    bus_of = read_toml(roles, RoleMap).bus_of if os.path.lexists(roles) else any_bus
    database = load_database(find_database(folder), bus_of)
    logs = parse_portions(candump_pieces(path, progress), str(path), warnings, at_once)
    return (sort_log(log, database) for log in _that_can_be_exported(logs, path)), database


def _that_can_be_exported(logs: Iterable[FrameLog], path: Path) -> Iterator[FrameLog]:
    """The same portions. Raises InputError where there are no frames, or too many buses."""
    found = 0
    for log in logs:
        found += len(log)
        if not found or len(log.buses) > MOST_BUSES:
            raise InputError(
                "this recording cannot be exported",
                where=str(path),
                expected=f"at least one frame, of at most {MOST_BUSES} buses",
                found=f"{found} frames of {len(log.buses)} buses",
            )
        yield log


Writer = Callable[[Iterator[SortedLog], Database, Path], int]


def _writers() -> Mapping[str, Writer]:
    """Writers by format; the libraries that they need are imported here, on first use."""
    from slipbench.protocol.export.asc import write_asc
    from slipbench.protocol.export.blf import write_blf
    from slipbench.protocol.export.mcap_file import write_mcap
    from slipbench.protocol.export.mf4 import write_mf4
    from slipbench.protocol.export.parquet import write_parquet

    return {
        "mf4": write_mf4,
        "blf": write_blf,
        "asc": write_asc,
        "parquet": write_parquet,
        "mcap": write_mcap,
    }
