"""Export as a folder of Parquet tables: the raw frames, and one table per message.

frames.parquet    time_ns, bus, identifier, extended, fd, fd_flags, sent, data (binary)
MESSAGE.parquet   time_ns, bus, and a column a signal, its unit in the column's metadata; null where
                  a multiplexed signal is not in the frame
"""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np

from slipbench.protocol.database.layout import Database
from slipbench.protocol.export.lengths import fd_flags
from slipbench.protocol.extras import optional_library
from slipbench.protocol.logs.decode import Frames, SortedLog
from slipbench.protocol.logs.frame_log import FrameLog
from slipbench.protocol.logs.sample_table import exact_column


def write_parquet(portions: Iterator[SortedLog], _database: Database, path: Path) -> int:
    """Write the folder, one row group per portion; returns the number of decoded samples."""
    path.mkdir()
    samples = 0
    with ExitStack() as files:
        tables: dict[str, Any] = {}
        for portion in portions:
            _append(files, tables, path / "frames.parquet", _frames(portion.log))
            for name, frames in portion.frames.items():
                if len(frames):
                    table, count = _message(portion.log, frames)
                    _append(files, tables, path / f"{name}.parquet", table)
                    samples += count
    return samples


def _append(files: ExitStack, tables: dict[str, Any], path: Path, table: Any) -> None:
    """Append to an open table, or create it."""
    parquet = optional_library("pyarrow.parquet")

    if path.name not in tables:
        tables[path.name] = files.enter_context(parquet.ParquetWriter(path, table.schema))
    tables[path.name].write_table(table)


def _frames(log: FrameLog) -> Any:
    pa = optional_library("pyarrow")

    ends = np.concatenate([[0], np.cumsum(log.length, dtype=np.int64)])
    within = np.arange(log.data.shape[1]) < log.length[:, None]
    offsets = pa.py_buffer(ends.astype(np.int64).tobytes())
    data = pa.Array.from_buffers(
        pa.large_binary(), len(log), [None, offsets, pa.py_buffer(log.data[within].tobytes())]
    )
    return pa.table(
        {
            "time_ns": log.time_ns,
            "bus": _buses(log, np.arange(len(log))),
            "identifier": log.identifier,
            "extended": log.extended,
            "fd": log.fd,
            "fd_flags": fd_flags(log),
            "sent": log.sent,
            "data": data,
        }
    )


def _message(log: FrameLog, frames: Frames) -> tuple[Any, int]:
    pa = optional_library("pyarrow")

    columns: list[Any] = [log.time_ns[frames.rows], _buses(log, frames.rows)]
    fields = [pa.field("time_ns", pa.int64()), pa.field("bus", columns[1].type)]
    count = 0
    for signal in frames.message.signals:
        samples = frames.samples(signal.name)
        value = np.zeros(len(frames), samples.exact.dtype)
        absent = np.ones(len(frames), np.bool_)
        place = np.searchsorted(frames.rows, samples.rows)
        value[place], absent[place] = samples.exact, False
        columns.append(exact_column(value, absent))
        fields.append(pa.field(signal.name, columns[-1].type, metadata={"unit": signal.unit}))
        count += int(samples.rows.size)
    return pa.table(columns, schema=pa.schema(fields)), count


def _buses(log: FrameLog, rows: np.ndarray) -> Any:
    pa = optional_library("pyarrow")

    return pa.DictionaryArray.from_arrays(log.bus[rows].astype(np.int32), list(log.buses))
