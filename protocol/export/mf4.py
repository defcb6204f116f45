"""A recording as ASAM MDF 4: raw frames as a bus log (ASAM's bus logging standard) and signals.

Signals are called MESSAGE.SIGNAL, for a name such as "time" is a message's and MDF's own as well.
The times of an MDF file are doubles, s since its start. That is put on the whole microsecond before
the first frame, so that a nanosecond survives in a recording of a day.
"""

from pathlib import Path
from typing import Any

import numpy as np

from protocol.decode import Frames, SortedLog
from protocol.export.lengths import dlc, fd_flags
from protocol.frame_log import FrameLog
from protocol.layout import Database, Signal

MICROSECOND = 1000  # ns


def write_mf4(sorted_log: SortedLog, database: Database, path: Path) -> int:
    """Write frames and signals; returns the number of decoded samples."""
    import asammdf

    log = sorted_log.log
    start = int(log.time_ns[0]) // MICROSECOND * MICROSECOND
    time = (log.time_ns - start) * 1e-9
    with asammdf.MDF(version="4.11") as mdf:
        mdf.header.abs_time = start
        mdf.header.comment = f"slipbench; decoded with {Path(database.origin).name}"
        for number, bus in enumerate(log.buses):
            _append_frames(mdf, log, time, number, bus)
        samples = sum(
            _append_message(mdf, frames, log, time) for frames in sorted_log.frames.values()
        )
        with path.open("wb") as file:
            mdf.save(file, compression=0)
    return samples


def _append_frames(mdf: Any, log: FrameLog, time: np.ndarray, number: int, bus: str) -> None:
    rows = slice(None) if len(log.buses) == 1 else np.flatnonzero(log.bus == number)
    frames, width = dict(vars(log)), log.data.shape[1]
    columns: dict[str, tuple[str, Any]] = {
        "BusChannel": ("<u1", number + 1), "ID": ("<u4", frames["identifier"][rows]),
        "IDE": ("<u1", log.extended[rows]), "DLC": ("<u1", dlc(log)[rows]),
        "DataLength": ("<u1", log.length[rows]), "DataBytes": (f"({width},)u1", log.data[rows]),
        "Dir": ("<u1", log.sent[rows]), "EDL": ("<u1", log.fd[rows]),
        "BRS": ("<u1", fd_flags(log)[rows] & 1), "ESI": ("<u1", fd_flags(log)[rows] >> 1 & 1),
    }  # fmt: skip
    kind = np.dtype([(f"CAN_DataFrame.{name}", form) for name, (form, _) in columns.items()])
    records = np.empty(time[rows].size, kind)
    for name, (_, column) in columns.items():
        records[f"CAN_DataFrame.{name}"] = column
    mdf.append([_signal("CAN_DataFrame", records, time[rows], bus)], common_timebase=True)


def _signal(name: str, samples: np.ndarray, time: np.ndarray, bus: str) -> Any:
    import asammdf
    from asammdf.blocks.v4_constants import BUS_TYPE_CAN, SOURCE_BUS

    source = asammdf.Source(bus, bus, "", SOURCE_BUS, BUS_TYPE_CAN)
    return asammdf.Signal(name=name, samples=samples, timestamps=time, source=source)


def _append_message(mdf: Any, frames: Frames, log: FrameLog, time: np.ndarray) -> int:
    """Append a message's signals, those of one multiplexed page together; returns the samples."""
    pages: dict[tuple[str | None, tuple[int, ...]], list[Signal]] = {}
    for signal in frames.message.signals if len(frames) else ():
        pages.setdefault((signal.multiplexer, signal.multiplexer_ids), []).append(signal)
    return sum(_append_page(mdf, frames, page, log, time) for page in pages.values())


def _append_page(
    mdf: Any, frames: Frames, page: list[Signal], log: FrameLog, time: np.ndarray
) -> int:
    import asammdf

    columns = [frames.samples(signal.name) for signal in page]
    rows = columns[0].rows
    if not rows.size:
        return 0
    for bus in np.unique(log.bus[rows]):
        mine = log.bus[rows] == bus
        source = asammdf.Source(log.buses[bus], f"{frames.message.name}", "", 0, 0)
        signals = [
            asammdf.Signal(
                name=f"{frames.message.name}.{column.signal.name}",
                samples=np.asarray(column.value)[mine],
                timestamps=time[rows[mine]],
                unit=column.signal.unit,
                comment=column.signal.comment,
                source=source,
            )
            for column in columns
        ]
        mdf.append(
            signals, acq_name=f"{log.buses[bus]}.{frames.message.name}", common_timebase=True
        )
    return int(rows.size) * len(columns)
