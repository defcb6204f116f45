"""ASAM MDF files (.mf4) with bus logging: raw frames in groups called CAN_DataFrame."""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, fields
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.logs.candump_line import format_frames
from slipbench.protocol.logs.frame_log import FrameLog
from slipbench.protocol.logs.mdf_chains import check_chains
from slipbench.protocol.logs.reading import Progress

AT_ONCE = 200_000  # frames of a group that are read at once
_FRAMES = "CAN_DataFrame"
_BESIDE = {
    "CAN_ErrorFrame": "error frames",
    "CAN_RemoteFrame": "remote frames",
    "LIN_Frame": "LIN frames",
    "FLX_Frame": "FlexRay frames",
    "ETH_Frame": "Ethernet frames",
}


# Its index of a bus log, which is not needed here, reads the whole file.
_OPTIONS: dict[str, Any] = {"process_bus_logging": False}


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """An open MDF file (asammdf.MDF). Raises InputError for every error in a damaged file."""
    asammdf = optional_library("asammdf")

    check_chains(path)
    trouble = ""
    with _silent_finalisers():
        try:
            with asammdf.MDF(path, **_OPTIONS) as mdf:
                yield mdf
        except InputError:
            raise
        except Exception as cause:  # asammdf passes on any exception of its parsing
            trouble = f"{type(cause).__name__}: {cause}"[:300]
    if trouble:
        raise InputError(
            "asammdf cannot read this file",
            where=str(path),
            expected="a whole ASAM MDF file",
            found=trouble,
            remedy="was the logger switched off before it closed the file? repair it with the"
            " logger's own program, or take a copy",
        )


@contextmanager
def _silent_finalisers() -> Iterator[None]:
    """Suppress the tracebacks of asammdf's incomplete objects when they are collected."""
    before, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        yield
        gc.collect()
    finally:
        sys.unraisablehook = before


def has_raw_frames(mdf: Any) -> bool:
    """Whether the file is a bus log, not one of decoded channels."""
    return _FRAMES in mdf.channels_db


def mdf_pieces(path: Path, warnings: list[str], progress: Progress) -> Iterator[bytes]:
    """Raw frames of an MDF file as pieces of candump text, in order of time.

    Raises InputError where the file is damaged or holds no raw frames.
    """
    with opened(path) as mdf:
        if not has_raw_frames(mdf):
            raise InputError(
                "this MDF file holds no raw CAN frames",
                where=str(path),
                expected=f"a bus log (channel {_FRAMES})",
                found=f"{len(mdf.channels_db)} decoded channels",
                remedy="give it to `slipbench import` as a table, with a role map of columns",
            )
        _warn_of_omitted_frames(mdf, path, warnings)
        groups = _groups(mdf)
        done, total = 0, sum(group.remaining for group in groups)
        for frames in _merged(groups):
            lines = format_frames(frames)
            while piece := b"".join(islice(lines, 20_000)):
                yield piece
            done += len(frames)
            progress(done / total)


def _warn_of_omitted_frames(mdf: Any, path: Path, warnings: list[str]) -> None:
    for name, title in _BESIDE.items():
        count = sum(
            int(mdf.groups[group].channel_group.cycles_nr)
            for group, _ in mdf.channels_db.get(name, ())
        )
        if count:
            warnings.append(f"{path}: {count} {title} are no data frames and are omitted")


def _groups(mdf: Any) -> "list[_Group]":
    start_ns = round(mdf.header.start_time.timestamp() * 1e6) * 1000
    counts = {
        group: int(mdf.groups[group].channel_group.cycles_nr)
        for group, _ in mdf.channels_db[_FRAMES]
    }
    return [_Group(mdf, group, start_ns, count) for group, count in counts.items() if count]


def _merged(groups: "list[_Group]") -> Iterator[FrameLog]:
    """Frames of several groups in order of time; each group is in order itself."""
    while groups:
        parts = [group.read() for group in groups]
        ends = [
            part.time_ns.max() for part, group in zip(parts, groups, strict=True) if group.remaining
        ]
        until = min(ends, default=None)
        complete = [
            np.full(len(p.time_ns), True) if until is None else p.time_ns <= until for p in parts
        ]
        yield _joined([part.select(rows) for part, rows in zip(parts, complete, strict=True)])
        for group, part, rows in zip(groups, parts, complete, strict=True):
            group.pending = part.select(~rows)
        groups = [group for group in groups if group.remaining or group.has_pending]


def _joined(parts: "list[_Part]") -> FrameLog:
    width = 64 if any(part.data.shape[1] > 8 for part in parts) else 8
    columns: dict[str, Any] = {
        field.name: np.concatenate([getattr(part, field.name) for part in parts])
        for field in fields(_Part)
        if field.name != "data"
    }
    data = np.concatenate([_padded(part.data, width) for part in parts])
    order = np.argsort(columns["time_ns"], kind="stable")
    channels, bus = np.unique(columns["bus"], return_inverse=True)
    columns["bus"] = bus.astype(np.uint8)
    frames = FrameLog(**columns, data=data, buses=tuple(f"can{channel}" for channel in channels))
    return frames.select(order)


def _padded(data: np.ndarray, width: int) -> np.ndarray:
    return np.pad(data[:, :width], ((0, 0), (0, max(width - data.shape[1], 0))))


@dataclass(frozen=True)
class _Part:
    """Frames of one channel group."""

    time_ns: np.ndarray
    bus: np.ndarray
    identifier: np.ndarray
    extended: np.ndarray
    fd: np.ndarray
    sent: np.ndarray
    length: np.ndarray
    fd_flags: np.ndarray
    data: np.ndarray

    def select(self, rows: np.ndarray) -> "_Part":
        """The frames where `keep`, shape (n,), is True."""
        return _Part(*(getattr(self, field.name)[rows] for field in fields(self)))


@dataclass
class _Group:
    """A channel group that is read from its beginning to its end.

    remaining: number of frames not yet read. pending: frames read that are later than the last
    frame read of some other group.
    """

    mdf: Any
    number: int
    start_ns: int
    remaining: int
    pending: _Part | None = None
    _read: int = 0

    @property
    def has_pending(self) -> bool:
        """Whether frames are pending."""
        return self.pending is not None and len(self.pending.time_ns) > 0

    def read(self) -> _Part:
        """Pending frames; without any, the next frames of the file."""
        if self.pending is not None and self.has_pending:
            return self.pending
        count = min(self.remaining, AT_ONCE)
        part = self._part(count)
        self._read, self.remaining = self._read + count, self.remaining - count
        return part

    def _part(self, count: int) -> _Part:
        """Read frames; fields that a logger left out are zero."""
        which: dict[str, Any] = {
            "group": self.number,
            "raw": True,
            "record_offset": self._read,
            "record_count": count,
        }
        signal = self.mdf.get(_FRAMES, **which)
        records, count = signal.samples, len(signal.timestamps)

        def field(name: str) -> np.ndarray:
            full = f"{_FRAMES}.{name}"
            if full in (records.dtype.names or ()):
                return np.asarray(records[full])
            if any(channel.name == full for channel in self.mdf.groups[self.number].channels):
                return np.asarray(self.mdf.get(full, **which).samples)
            return np.zeros(count, np.uint8)

        data = np.asarray(field("DataBytes"), np.uint8).reshape(count, -1)
        length = np.minimum(field("DataLength"), data.shape[1]).astype(np.uint8)
        data = np.where(np.arange(data.shape[1]) < length[:, None], data, 0).astype(np.uint8)
        identifier = field("ID").astype(np.uint32)
        return _Part(
            time_ns=self.start_ns + np.round(signal.timestamps * 1e9).astype(np.int64),
            bus=field("BusChannel").astype(np.int64),
            identifier=identifier & 0x1FFFFFFF,
            extended=(field("IDE") != 0) | (identifier > 0x7FF),
            fd=field("EDL") != 0,
            sent=field("Dir") != 0,
            length=length,
            fd_flags=((field("BRS") != 0) + 2 * (field("ESI") != 0)).astype(np.uint8),
            data=data,
        )
