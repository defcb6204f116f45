"""Export as ASAM MDF 4: raw frames as a bus log (ASAM's bus logging standard) and signals.

Signals are called MESSAGE.SIGNAL, for a name such as "time" is a message's and MDF's own as well;
the plain name SIGNAL is their display name, by which readers find them too.
The times of an MDF file are doubles, s since its start. That is put on the whole microsecond before
the first frame, so that a nanosecond survives in a recording of a day.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.database.layout import Database, Signal
from slipbench.protocol.errors import InputError
from slipbench.protocol.export.lengths import dlc, fd_flags
from slipbench.protocol.extras import optional_library
from slipbench.protocol.logs.decode import Frames, Samples, SortedLog
from slipbench.protocol.logs.frame_log import FrameLog

MICROSECOND = 1000  # ns


def write_mf4(portions: Iterator[SortedLog], database: Database, path: Path) -> int:
    """Write frames and signals; returns the number of decoded samples.

    asammdf keeps what it is given in a file, which lies beside `path`: a folder for temporary files
    may be memory.
    """
    asammdf = optional_library("asammdf")

    start: int | None = None
    samples = 0
    with asammdf.MDF(version="4.11", temporary_folder=str(path.parent)) as mdf:
        groups = _Groups(mdf)
        for portion in portions:
            log = portion.log
            if start is None:
                start = int(log.time_ns[0]) // MICROSECOND * MICROSECOND
            time = (log.time_ns - start) * 1e-9
            for number in range(len(log.buses)):
                _append_frames(groups, log, time, number)
            samples += sum(
                _append_message(groups, frames, log, time) for frames in portion.frames.values()
            )
        mdf.header.abs_time = start or 0
        mdf.header.comment = f"slipbench; decoded with {Path(database.origin).name}"
        with path.open("wb") as file:
            mdf.save(file, compression=0)
    return samples


class _Groups:
    """Channel groups of a file, created with their first samples and extended afterwards."""

    def __init__(self, mdf: Any) -> None:
        self._mdf = mdf
        self._known: dict[tuple[object, ...], int] = {}

    def append(self, key: tuple[object, ...], signals: list[Any], name: str | None) -> None:
        """Append samples to the group `key`: signals of the same kinds each time, on one time."""
        if key in self._known:
            columns = [signals[0].timestamps, *(signal.samples for signal in signals)]
            self._mdf.extend(self._known[key], [(column, None) for column in columns])
        else:
            self._known[key] = self._mdf.append(signals, acq_name=name, common_timebase=True)


def _append_frames(groups: _Groups, log: FrameLog, time: np.ndarray, number: int) -> None:
    asammdf = optional_library("asammdf")
    constants = optional_library("asammdf.blocks.v4_constants")

    rows = slice(None) if len(log.buses) == 1 else np.flatnonzero(log.bus == number)
    width, bus = log.data.shape[1], log.buses[number]
    if not time[rows].size:
        return
    columns: dict[str, tuple[str, Any]] = {
        "BusChannel": ("<u1", number + 1),
        "ID": ("<u4", log.identifier[rows]),
        "IDE": ("<u1", log.extended[rows]),
        "DLC": ("<u1", dlc(log)[rows]),
        "DataLength": ("<u1", log.length[rows]),
        "DataBytes": (f"({width},)u1", log.data[rows]),
        "Dir": ("<u1", log.sent[rows]),
        "EDL": ("<u1", log.fd[rows]),
        "BRS": ("<u1", fd_flags(log)[rows] & 1),
        "ESI": ("<u1", fd_flags(log)[rows] >> 1 & 1),
    }
    kind = np.dtype([(f"CAN_DataFrame.{name}", form) for name, (form, _) in columns.items()])
    records = np.empty(time[rows].size, kind)
    for name, (_, column) in columns.items():
        records[f"CAN_DataFrame.{name}"] = column
    source = asammdf.Source(bus, bus, "", constants.SOURCE_BUS, constants.BUS_TYPE_CAN)
    signal = asammdf.Signal(
        name="CAN_DataFrame", samples=records, timestamps=time[rows], source=source
    )
    groups.append(("frames", number, width), [signal], None)


def _append_message(groups: _Groups, frames: Frames, log: FrameLog, time: np.ndarray) -> int:
    """Append a message's signals, those of one multiplexed page together; returns the samples."""
    pages: dict[tuple[str | None, tuple[int, ...]], list[Signal]] = {}
    for signal in frames.message.signals if len(frames) else ():
        pages.setdefault((signal.multiplexer, signal.multiplexer_ids), []).append(signal)
    return sum(_append_page(groups, frames, key, page, log, time) for key, page in pages.items())


def _append_page(
    groups: _Groups,
    frames: Frames,
    key: tuple[object, ...],
    page: list[Signal],
    log: FrameLog,
    time: np.ndarray,
) -> int:
    asammdf = optional_library("asammdf")

    columns = [frames.samples(signal.name) for signal in page]
    rows = columns[0].rows
    for bus in np.unique(log.bus[rows]).tolist():
        mine = log.bus[rows] == bus
        source = asammdf.Source(log.buses[bus], f"{frames.message.name}", "", 0, 0)
        signals = [
            asammdf.Signal(
                name=f"{frames.message.name}.{column.signal.name}",
                samples=_in_64_bits(column)[mine],
                timestamps=time[rows[mine]],
                unit=column.signal.unit,
                comment=column.signal.comment,
                source=source,
                display_names={column.signal.name: "display"},
            )
            for column in columns
        ]
        name = f"{log.buses[bus]}.{frames.message.name}"
        groups.append((frames.message.name, bus, key), signals, name)
    return int(rows.size) * len(columns)


def _in_64_bits(column: Samples) -> npt.NDArray[Any]:
    """Values as MDF can hold them. Raises InputError for whole numbers beyond 64 bits."""
    if column.exact.dtype == object:
        raise InputError(
            f"signal {column.signal.name} has whole numbers that MDF cannot hold",
            expected="at most 64 bits after scale and offset",
            found=f"{column.signal.length} bits, scale {column.signal.scale:g}",
            remedy="export as parquet or mcap, which hold them exactly",
        )
    return column.exact
