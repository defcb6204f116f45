"""Folder of one recording: created once, never overwritten, read for each analysis.

Writers (`slipbench import`, the bench while a trial runs) create the folder, put the files of
`protocol.recording.recording` into it and write the description last. `read` decodes the raw
frames afresh with the database and the role map that lie beside them.

    recording = read(Path("runs/subaru"))
    recording.channels["engine_speed"].value    # rad/s
    recording.missing                           # role -> why the recording has none of it
"""

import errno
import hashlib
import math
import os
import platform
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any

import tomli_w

from slipbench.protocol.codec.bus_load import bus_load
from slipbench.protocol.configuration import load_toml, read_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import Progress, quiet
from slipbench.protocol.logs.candump import candump_pieces, parse_pieces
from slipbench.protocol.logs.decode import SortedLog, sort_log
from slipbench.protocol.recording.channels import Bound, bind, start_of
from slipbench.protocol.recording.database_copy import find_database
from slipbench.protocol.recording.log_faults import log_faults
from slipbench.protocol.recording.message_rules import with_rules
from slipbench.protocol.recording.recording import BusFault, Recording
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.recording.sender_check import interleaved_messages
from slipbench.protocol.recording.trial_phases import phase_channel
from slipbench.protocol.tables import Table, read_table
from slipbench.protocol.trial_file import TrialFile
from slipbench.protocol.user_file import is_folder, open_user_file

DESCRIPTION, FRAMES = "run.toml", "frames.log"
ROLES, TRIAL, VEHICLE, TABLES = "roles.toml", "trial.toml", "vehicle.toml", "tables"

LONGEST_WAIT = 86_400_000_000_000  # ns; a trial may wait for its first frame, not for days
_LIBRARIES = ("slipbench", "numpy", "cantools", "python-can", "asammdf", "pyarrow")


def create(path: Path) -> Path:
    """New folder for a recording, at `path`. Raises InputError where something exists already."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.mkdir()
    except (OSError, ValueError) as cause:  # ValueError: a NUL character in the name
        if os.path.lexists(path):
            raise InputError(
                "it exists, and a recording is never overwritten",
                where=str(path),
                remedy="give another name with --out, or remove it yourself",
            ) from cause
        raise InputError("cannot be made", where=str(path), found=str(cause)) from cause
    return path


def missing_parents(path: Path) -> list[Path]:
    """Folders above `path` that do not exist yet, the innermost first."""
    return [parent for parent in path.parents if not os.path.lexists(parent)]


def discard(path: Path, parents: Iterable[Path]) -> None:
    """Remove a new run folder, and those of its parents that are empty, the innermost first."""
    shutil.rmtree(path, ignore_errors=True)
    with suppress(OSError):  # another process has written into it
        for parent in parents:
            parent.rmdir()


def write_description(folder: Path, description: Mapping[str, Any]) -> None:
    """Write run.toml, whole or not at all; it may be written again as more is known.

    Bytes of a file name that are not UTF-8 become question marks.
    """
    write_description_text(folder, tomli_w.dumps(dict(description)))


def write_description_text(folder: Path, text: str) -> None:
    """Write run.toml from its text, whole or not at all."""
    draft = folder / (DESCRIPTION + ".part")
    with draft.open("wb") as file:
        file.write(text.encode("utf-8", "replace"))
        file.flush()
        os.fsync(file.fileno())
    draft.replace(folder / DESCRIPTION)


def versions() -> dict[str, str]:
    """Versions of slipbench, Python and the libraries in use, by name."""
    found = {"python": platform.python_version()}
    for name in _LIBRARIES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "unknown"
    return found


def sha256(path: Path) -> str:
    """SHA-256 checksum of a file, hexadecimal. Raises InputError where it cannot be read."""
    with open_user_file(path) as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def read(folder: Path, progress: Progress = quiet) -> Recording:
    """Recording of a run folder. Raises InputError naming what is missing, damaged or contradictory."""
    warnings: list[str] = []
    _require_recording(folder)
    _refuse_ways_out(folder)
    description = _description(folder, warnings)
    roles = read_toml(folder / ROLES, RoleMap)
    tables = _tables(folder, description)
    sorted_log, database = _decoded(folder, description, roles, warnings, progress)
    if sorted_log is None and not tables:
        raise InputError("it holds neither frames nor tables", where=str(folder), expected=FRAMES)
    start_ns = _start_ns(description, start_of(sorted_log, tables, roles), folder)
    bound = bind(sorted_log, database, tables, roles, start_ns)
    duration = _duration(sorted_log, bound, start_ns)
    channels, missing = dict(bound.channels), dict(bound.missing)
    phases = phase_channel(description, start_ns, duration)
    if "trial_phase" not in channels and phases is not None:
        channels["trial_phase"] = phases
        missing.pop("trial_phase", None)
    texts = [*description.get("warnings", []), *warnings, *bound.warnings]
    return Recording(
        folder=folder,
        description={**description, "warnings": list(dict.fromkeys(texts))},
        trial=(
            read_toml(folder / TRIAL, TrialFile, recorded=True)
            if (folder / TRIAL).exists()
            else None
        ),
        roles=roles,
        channels=channels,
        missing=missing,
        frame_count=len(sorted_log.log) if sorted_log else 0,
        duration=duration,
        start_time_ns=start_ns,
        faults=_faults(sorted_log, bound, start_ns),
        bus_load=_bus_load(sorted_log, description, roles),
    )


def _refuse_ways_out(folder: Path) -> None:
    """Check every link below a recording. Raises InputError where one leads out, or in a loop."""
    inside = Path(os.path.realpath(folder))
    for item in folder.rglob("*"):
        if item.is_symlink() and not _leads_below(item, inside):
            raise InputError(
                "a link leads out of the recording, or to itself",
                where=str(item),
                expected=f"files below {folder}",
                found=str(item.readlink()),
                remedy="a recording is complete in itself: put the file itself there",
            )


def _leads_below(link: Path, folder: Path) -> bool:
    try:
        link.stat()
    except OSError as cause:
        if cause.errno == errno.ELOOP:
            return False
    return Path(os.path.realpath(link)).is_relative_to(folder)


def _decoded(
    folder: Path,
    description: Mapping[str, Any],
    roles: RoleMap,
    warnings: list[str],
    progress: Progress,
) -> tuple[SortedLog | None, Database | None]:
    """Frames sorted by message, and the database; None where there is no log of frames."""
    path = folder / FRAMES
    if not path.exists():
        return None, None
    log = parse_pieces(candump_pieces(path, progress), FRAMES, warnings)
    copy = find_database(folder)
    database = load_database(copy, roles.bus_of)
    stated = _table(description, "run").get("database_sha256")
    if stated and stated != database.sha256:
        warnings.append(
            f"{copy.name} has changed since the recording:"
            f" sha256 {database.sha256[:12]}, recorded with {str(stated)[:12]}"
        )
    ruled = with_rules(database, dict(roles.messages), str(folder / ROLES))
    return sort_log(log, ruled), ruled


def _table(description: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    found = description.get(name)
    return found if isinstance(found, Mapping) else {}


def _start_ns(description: Mapping[str, Any], first: int, folder: Path) -> int:
    """Time zero of the recording, ns: as the description states it, else its first sample.

    Raises InputError where the two are more than LONGEST_WAIT apart: every time would be wrong.
    """
    for name in ("run", "bus"):
        stated = _table(description, name).get("start_time_ns")
        if isinstance(stated, int):
            if abs(stated - first) > LONGEST_WAIT:
                raise InputError(
                    f"{name}.start_time_ns does not belong to these frames or tables",
                    where=str(folder / DESCRIPTION),
                    expected=f"at most a day before or after the first sample ({first} ns)",
                    found=f"{stated:.20g} ns" if abs(stated) < 1 << 63 else "beyond 64 bits",
                    remedy="restore the description, or remove that line in a copy",
                )
            return stated
    return first


def _require_recording(folder: Path) -> None:
    """Check for the files of a recording before its tree is walked. Raises InputError."""
    if not is_folder(folder):
        raise InputError(
            "there is no recording of this name",
            where=str(folder),
            expected=f"a folder with {DESCRIPTION}",
            remedy="check the path",
        )
    names = (DESCRIPTION, FRAMES)
    if not any(os.path.lexists(folder / name) for name in names):
        raise InputError(
            "this folder is no recording",
            where=str(folder),
            expected=f"{DESCRIPTION}, {FRAMES}",
            found=", ".join(sorted(item.name for item in folder.iterdir())[:8]) or "nothing",
        )


def _description(folder: Path, warnings: list[str]) -> dict[str, Any]:
    if os.path.lexists(folder / DESCRIPTION):
        return _checked_types(load_toml(folder / DESCRIPTION), str(folder / DESCRIPTION))
    warnings.append(f"there is no {DESCRIPTION}: the recording was not completed")
    return {}


def _checked_types(description: dict[str, Any], where: str) -> dict[str, Any]:
    """The same description. Raises InputError where a key that is read here has another type."""
    found = {name: description.get(name, {}) for name in ("run", "bus", TABLES)}
    wrong = [f"{name}: a table" for name, what in found.items() if not isinstance(what, dict)]
    if not isinstance(description.get("warnings", []), list):
        wrong.append("warnings: a list")
    rates = found["bus"] if isinstance(found["bus"], dict) else {}
    wrong += [
        f"bus.{name}: a number above 0"
        for name in {"bitrate", "data_bitrate"} & set(rates)
        if not isinstance(rates[name], int | float) or not 0 < rates[name] < math.inf
    ]
    if wrong:
        raise InputError(
            "a key has a value of the wrong type",
            where=where,
            expected="; ".join(sorted(wrong)),
            remedy="correct it in a copy of the recording",
        )
    description["warnings"] = [str(text) for text in description.get("warnings", [])]
    return description


def _tables(folder: Path, description: Mapping[str, Any]) -> dict[str, Table]:
    """Side tables by name. Raises InputError for a path in run.toml that leads out of the folder."""
    found = {}
    for name, place in _table(description, TABLES).items():
        path = folder / str(place).replace("\0", "\\0")  # no file has a NUL character in its name
        if not path.resolve().is_relative_to(folder.resolve()):
            raise InputError(
                f"table {name!r} leads out of the recording",
                where=str(folder / DESCRIPTION),
                expected=f"a file below {folder}",
                found=str(place),
                remedy="a recording is complete in itself: import the table anew",
            )
        found[str(name)] = read_table(path)
    return found


def _duration(sorted_log: SortedLog | None, bound: Bound, start_ns: int) -> float:
    """Time from the recording's start to its last frame, or to its last row, s."""
    if sorted_log is not None and len(sorted_log.log):
        return float(sorted_log.log.time_ns[-1] - start_ns) * 1e-9
    return max((float(channel.time[-1]) for channel in bound.channels.values()), default=0.0)


def _faults(sorted_log: SortedLog | None, bound: Bound, start_ns: int) -> tuple[BusFault, ...]:
    """All faults in order of time, counted from the recording's start."""
    if sorted_log is None or not len(sorted_log.log):
        return bound.faults
    before = (int(sorted_log.log.time_ns[0]) - start_ns) * 1e-9
    found = [
        replace(fault, first_time=fault.first_time + before) for fault in log_faults(sorted_log)
    ]
    found += [*interleaved_messages(sorted_log, start_ns), *bound.faults]
    return tuple(sorted(found, key=lambda fault: fault.first_time))


def _bus_load(
    sorted_log: SortedLog | None, description: Mapping[str, Any], roles: RoleMap
) -> dict[str, Any]:
    """Load of each bus, where its bit rate is known."""
    bus = _table(description, "bus")
    bitrate = bus.get("bitrate", roles.bitrate)
    if sorted_log is None or not len(sorted_log.log) or not bitrate:
        return {}
    loads = bus_load(sorted_log.log, float(bitrate), bus.get("data_bitrate"))
    return {
        name: {"mean": of.mean, "peak": of.peak, "time": of.time, "load": of.load}
        for name, of in loads.items()
    }
