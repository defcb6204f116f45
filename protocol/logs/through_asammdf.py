"""ASAM MDF files (.mf4) with bus logging: raw frames in groups called CAN_DataFrame."""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from protocol.errors import InputError
from protocol.frame_log import FrameLog
from protocol.logs.candump import parse_pieces
from protocol.logs.candump_line import format_frames
from protocol.logs.reading import Progress

_FRAMES = "CAN_DataFrame"
_BESIDE = {
    "CAN_ErrorFrame": "error frames", "CAN_RemoteFrame": "remote frames",
    "LIN_Frame": "LIN frames", "FLX_Frame": "FlexRay frames", "ETH_Frame": "Ethernet frames",
}  # fmt: skip


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """Open an MDF file; whatever asammdf meets in a damaged one becomes an InputError."""
    import asammdf

    trouble = ""
    with _silent_finalisers():
        try:
            with asammdf.MDF(path) as mdf:
                yield mdf
        except InputError:
            raise
        except Exception as cause:  # asammdf lets through whatever its parsing meets
            trouble = f"{type(cause).__name__}: {cause}"[:300]
    if trouble:
        raise InputError(
            "asammdf cannot read this file", where=str(path), expected="a whole ASAM MDF file",
            found=trouble,
            remedy="was the logger switched off before it closed the file? repair it with the"
            " logger's own program, or take a copy",
        )  # fmt: skip


@contextmanager
def _silent_finalisers() -> Iterator[None]:
    """Keep asammdf's half-made objects from writing tracebacks when they are collected."""
    told, sys.unraisablehook = sys.unraisablehook, lambda _: None
    try:
        yield
        gc.collect()
    finally:
        sys.unraisablehook = told


def has_raw_frames(mdf: Any) -> bool:
    """Tell a bus log from a file of decoded channels."""
    return _FRAMES in mdf.channels_db


def mdf_pieces(path: Path, warnings: list[str], progress: Progress) -> Iterator[bytes]:
    """Read all raw frames as pieces of candump text, in order of time."""
    with opened(path) as mdf:
        if not has_raw_frames(mdf):
            raise InputError(
                "this MDF file holds no raw CAN frames", where=str(path),
                expected=f"a bus log (channel {_FRAMES})",
                found=f"{len(mdf.channels_db)} decoded channels",
                remedy="give it to `slipbench import` as a table, with a role map of columns",
            )  # fmt: skip
        _tell_what_stays_out(mdf, path, warnings)
        frames = _frames(mdf)
    lines = format_frames(frames)
    done = 0
    while piece := b"".join(islice(lines, 20_000)):
        done += 20_000
        progress(min(done / len(frames), 1.0))
        yield piece


def _tell_what_stays_out(mdf: Any, path: Path, warnings: list[str]) -> None:
    for name, title in _BESIDE.items():
        count = sum(
            int(mdf.groups[group].channel_group.cycles_nr)
            for group, _ in mdf.channels_db.get(name, ())
        )
        if count:
            warnings.append(f"{path}: {count} {title} are no data frames and stay out")


def _frames(mdf: Any) -> FrameLog:
    """Give the frames of all groups in order of time."""
    start_ns = round(mdf.header.start_time.timestamp() * 1e6) * 1000
    parts = [
        _Part.of(mdf, group, start_ns)
        for group, _ in mdf.channels_db[_FRAMES]
        if mdf.groups[group].channel_group.cycles_nr
    ]
    if not parts:
        return parse_pieces([], "", [])
    width = 64 if any(part.data.shape[1] > 8 for part in parts) else 8
    whole: dict[str, Any] = {
        name: np.concatenate([getattr(part, name) for part in parts])
        for name in ("time_ns", "bus", "identifier", "extended", "fd", "sent", "length", "fd_flags")
    }
    data = np.concatenate([_padded(part.data, width) for part in parts])
    order = np.argsort(whole["time_ns"], kind="stable")
    channels, bus = np.unique(whole["bus"], return_inverse=True)
    whole["bus"] = bus.astype(np.uint8)
    frames = FrameLog(**whole, data=data, buses=tuple(f"can{channel}" for channel in channels))
    return frames.select(order)


def _padded(data: np.ndarray, width: int) -> np.ndarray:
    return np.pad(data[:, :width], ((0, 0), (0, max(width - data.shape[1], 0))))


@dataclass(frozen=True)
class _Part:
    """The frames of one channel group."""

    time_ns: np.ndarray
    bus: np.ndarray
    identifier: np.ndarray
    extended: np.ndarray
    fd: np.ndarray
    sent: np.ndarray
    length: np.ndarray
    fd_flags: np.ndarray
    data: np.ndarray

    @staticmethod
    def of(mdf: Any, group: int, start_ns: int) -> "_Part":
        """Read the group; fields that a logger left out are zero."""
        signal = mdf.get(_FRAMES, group=group, raw=True)
        records, count = signal.samples, len(signal.timestamps)

        def field(name: str) -> np.ndarray:
            full = f"{_FRAMES}.{name}"
            if full in (records.dtype.names or ()):
                return np.asarray(records[full])
            if any(channel.name == full for channel in mdf.groups[group].channels):
                return np.asarray(mdf.get(full, group=group, raw=True).samples)
            return np.zeros(count, np.uint8)

        data = np.asarray(field("DataBytes"), np.uint8).reshape(count, -1)
        length = np.minimum(field("DataLength"), data.shape[1]).astype(np.uint8)
        data = np.where(np.arange(data.shape[1]) < length[:, None], data, 0).astype(np.uint8)
        identifier = field("ID").astype(np.uint32)
        return _Part(
            time_ns=start_ns + np.round(signal.timestamps * 1e9).astype(np.int64),
            bus=field("BusChannel").astype(np.int64),
            identifier=identifier & 0x1FFFFFFF,
            extended=(field("IDE") != 0) | (identifier > 0x7FF),
            fd=field("EDL") != 0,
            sent=field("Dir") != 0,
            length=length,
            fd_flags=((field("BRS") != 0) + 2 * (field("ESI") != 0)).astype(np.uint8),
            data=data,
        )
