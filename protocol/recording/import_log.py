"""Import a capture: raw frames, side tables, database and role map in one run folder."""

import shutil
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, BinaryIO

from slipbench.protocol.configuration import read_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import Progress, no_frames, open_log, quiet, unknown_format
from slipbench.protocol.logs.candump import parse_pieces
from slipbench.protocol.logs.formats import looks_like, read_head
from slipbench.protocol.recording import run_folder
from slipbench.protocol.recording.database_copy import copy_database
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.recording.run_folder import FRAMES, TABLES
from slipbench.protocol.recording.table_channels import MAIN
from slipbench.protocol.tables import is_table, read_table, write_parquet

YEAR_2000_NS = 946_684_800 * 1_000_000_000


@dataclass(frozen=True)
class Capture:
    """What is imported. `log` may be a table; `tables` are side channels by name."""

    log: Path
    roles: Path
    database: Path | None = None
    tables: Mapping[str, Path] = field(default_factory=dict)


def import_capture(capture: Capture, out: Path, progress: Progress = quiet) -> Recording:
    """Recording in the new folder `out`, as read back. Raises InputError; no folder is left then."""
    roles = read_toml(capture.roles, RoleMap)
    tables = _all_tables(capture, roles)
    parents = run_folder.missing_parents(out)
    run_folder.create(out)
    try:
        description = _write(capture, roles, tables, out, progress)
        run_folder.write_description(out, description)
        recording = run_folder.read(out)
        _require_samples(recording, capture.log)
        description["run"] |= _found(recording)
        run_folder.write_description(out, description)
    except OSError as cause:
        run_folder.discard(out, parents)
        raise InputError(
            "the recording cannot be written",
            where=str(out),
            found=str(cause),
            remedy="is the disk full, or the folder not yours? nothing was left behind",
        ) from cause
    except BaseException:
        run_folder.discard(out, parents)
        raise
    return replace(recording, description={**recording.description, "run": description["run"]})


def _require_samples(recording: Recording, log: Path) -> None:
    """Check that something was imported. Raises InputError for no frame and no sample."""
    if recording.frame_count or recording.channels:
        return
    reasons = [f"{role}: {reason}" for role, reason in recording.missing.items()]
    raise InputError(
        "nothing to import: no frame, and no sample of any role",
        where=str(log),
        found="; ".join(reasons[:4]) or "a role map without roles",
        remedy="bind roles to columns that hold numbers",
    )


def _all_tables(capture: Capture, roles: RoleMap) -> dict[str, Path]:
    """All tables by name; one in place of the log is called "main"."""
    tables = dict(capture.tables)
    unused = sorted(set(tables) - {source.table for source in roles.roles.values()})
    if unused:
        known = sorted({source.table for source in roles.roles.values() if source.table})
        raise InputError(
            f"no role is bound to the table {unused[0]!r}",
            where=str(capture.roles),
            expected=f"one of {', '.join(known)}" if known else "roles with a column",
            remedy=f'give a role table = "{unused[0]}" and column = "...", or omit --table',
        )
    if is_table(capture.log):
        tables[MAIN] = capture.log
    elif capture.database is None:
        if looks_like(read_head(capture.log)) is None:
            raise unknown_format(capture.log)
        raise InputError(
            "frames cannot be decoded without a database",
            where=str(capture.log),
            remedy="give the vehicle's DBC file with --dbc",
        )
    return tables


def _write(
    capture: Capture, roles: RoleMap, tables: Mapping[str, Path], out: Path, progress: Progress
) -> dict[str, Any]:
    """Description of the recording, after everything else of it is written."""
    shutil.copyfile(capture.roles, out / run_folder.ROLES)
    description: dict[str, Any] = {
        "run": {
            "kind": "import",
            "name": out.name,
            "what": roles.title,
            "imported": datetime.now(UTC).isoformat(timespec="seconds"),
        },
        "versions": run_folder.versions(),
        "sources": [],
        "warnings": [],
        TABLES: {},
    }
    if capture.database is not None:
        database = load_database(capture.database, roles.bus_of)
        copy_database(capture.database, out)
        description["run"] |= {
            "database": capture.database.name,
            "database_sha256": database.sha256,
        }
    if MAIN not in tables:
        _write_frames(capture.log, out / FRAMES, description, progress)
    for name, path in tables.items():
        _write_table(name, path, out, description)
    return description


def _write_frames(log: Path, out: Path, description: dict[str, Any], progress: Progress) -> None:
    """Keep every line of the log, of other formats as candump text; the order stays."""
    text = open_log(log, progress)
    with out.open("wb") as file:
        frames = parse_pieces(_kept(text.pieces, file), str(log), [])
    if not len(frames):
        raise no_frames(log, text.format, frames.skipped)
    beside = {name.replace(" ", "_"): count for name, count in frames.skipped}
    description["sources"].append(_source(log, text.format, frames=len(frames), **beside))
    description["warnings"].extend(text.warnings)


def _kept(pieces: Iterator[bytes], file: BinaryIO) -> Iterator[bytes]:
    for piece in pieces:
        file.write(piece)
        yield piece


def _write_table(name: str, path: Path, out: Path, description: dict[str, Any]) -> None:
    table = read_table(path)
    (out / TABLES).mkdir(exist_ok=True)
    write_parquet(table, out / TABLES / f"{name}.parquet")
    description[TABLES][name] = f"{TABLES}/{name}.parquet"
    layout = {"layout": "; ".join(table.layout)} if table.layout else {}
    description["sources"].append(
        _source(path, "table", table=name, rows=table.data.num_rows, **layout)
    )
    description["warnings"].extend(table.warnings)


def _source(path: Path, form: str, **more: str | int) -> dict[str, str | int]:
    return {
        "file": path.name,
        "format": form,
        "bytes": path.stat().st_size,
        "sha256": run_folder.sha256(path),
        **more,
    }


def _found(recording: Recording) -> dict[str, Any]:
    """Number of frames, duration (s) and start time of a recording."""
    found: dict[str, Any] = {"frames": recording.frame_count, "duration": recording.duration}
    start_ns = recording.start_time_ns
    found["start_time_ns"] = start_ns
    if start_ns > YEAR_2000_NS:  # a clock that counts from 1970, not from switching on
        found["started"] = datetime.fromtimestamp(start_ns * 1e-9, UTC).isoformat()
    return found
