"""Export as Vector BLF: objects of fixed size in compressed containers.

The layout is that of python-can's writer (after Tobias Lorenz, Vector BLF), which reads it back in
the tests. Times are whole nanoseconds since the start, which the file's header gives to the
millisecond; before 1990 it cannot, and the times then count from 1970.
"""

import struct
import zlib
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO

import numpy as np
import numpy.typing as npt

from slipbench.protocol.database.layout import Database
from slipbench.protocol.export.lengths import dlc, fd_flags
from slipbench.protocol.logs.decode import SortedLog
from slipbench.protocol.logs.frame_log import FrameLog

FILE_HEADER, CONTAINER = 144, 128 * 1024  # bytes
CAN_MESSAGE, LOG_CONTAINER, CAN_FD_MESSAGE = 1, 10, 100  # kinds of object
MILLISECOND, YEAR_1990 = 1_000_000, 631_152_000_000_000_000  # ns
NANOSECONDS, DEFLATED, VERSION = 2, 2, 1
EXTENDED = 0x8000_0000

_HEAD = [
    ("signature", "S4"),
    ("header_size", "<u2"),
    ("header_version", "<u2"),
    ("size", "<u4"),
    ("kind", "<u4"),
    ("time_unit", "<u4"),
    ("client", "<u2"),
    ("version", "<u2"),
    ("time", "<u8"),
    ("channel", "<u2"),
    ("flags", "u1"),
    ("dlc", "u1"),
    ("identifier", "<u4"),
]
CLASSIC = np.dtype([*_HEAD, ("data", "u1", (8,))])
FLEXIBLE = np.dtype(
    [
        *_HEAD,
        ("frame_length", "<u4"),
        ("bit_count", "u1"),
        ("fd_flags", "u1"),
        ("valid", "u1"),
        ("reserved", "u1", (5,)),
        ("data", "u1", (64,)),
    ]
)


def write_blf(portions: Iterator[SortedLog], _database: Database, path: Path) -> int:
    """Write the raw frames; this format holds no decoded signals."""
    count = last = unpacked = 0
    start: int | None = None
    remainder = b""
    with path.open("wb") as file:
        file.write(bytes(FILE_HEADER))
        for log in (portion.log for portion in portions if len(portion.log)):
            start = _start(log) if start is None else start
            objects = memoryview(remainder + _objects(log, start))
            complete = len(objects) // CONTAINER * CONTAINER
            unpacked += _write_containers(file, objects[:complete])
            remainder = bytes(objects[complete:])
            count, last = count + len(log), max(last, int(log.time_ns[-1]))
        unpacked += _write_containers(file, memoryview(remainder))
        written = file.tell()
        file.seek(0)
        file.write(_file_header(written, FILE_HEADER + unpacked, count, start or 0, last))
    return 0


def _start(log: FrameLog) -> int:
    first = int(log.time_ns[0])
    return first // MILLISECOND * MILLISECOND if first >= YEAR_1990 else 0


def _write_containers(file: BinaryIO, objects: memoryview) -> int:
    """Write objects as containers; returns the bytes that they take unpacked, with their heads."""
    pieces = range(0, len(objects), CONTAINER)
    for piece in pieces:
        _write_container(file, objects[piece : piece + CONTAINER])
    return len(objects) + 32 * len(pieces)


def _objects(log: FrameLog, start: int) -> bytes:
    """All frames as BLF objects, in their order."""
    classic, flexible = np.flatnonzero(~log.fd), np.flatnonzero(log.fd)
    if not flexible.size:
        return _records(log, classic, start, CLASSIC).tobytes()
    sizes = np.where(log.fd, FLEXIBLE.itemsize, CLASSIC.itemsize)
    places = np.cumsum(sizes) - sizes
    buffer = np.empty(int(sizes.sum()), np.uint8)
    for rows, kind in ((classic, CLASSIC), (flexible, FLEXIBLE)):
        bytes_ = _records(log, rows, start, kind).view(np.uint8).reshape(rows.size, kind.itemsize)
        buffer[places[rows][:, None] + np.arange(kind.itemsize)] = bytes_
    return buffer.tobytes()


def _records(
    log: FrameLog, rows: npt.NDArray[np.intp], start: int, kind: np.dtype[np.void]
) -> npt.NDArray[np.void]:
    records = np.zeros(rows.size, kind)
    records["signature"], records["header_size"], records["header_version"] = b"LOBJ", 32, VERSION
    records["size"], records["time_unit"] = kind.itemsize, NANOSECONDS
    records["kind"] = CAN_MESSAGE if kind is CLASSIC else CAN_FD_MESSAGE
    records["time"] = np.maximum(log.time_ns[rows] - start, 0)
    records["channel"] = log.bus[rows] + 1
    records["flags"], records["dlc"] = log.sent[rows], dlc(log)[rows]
    records["identifier"] = log.identifier[rows] | np.where(log.extended[rows], EXTENDED, 0)
    width = min(log.data.shape[1], records["data"].shape[1])
    records["data"][:, :width] = log.data[rows, :width]
    if kind is FLEXIBLE:
        records["fd_flags"] = 1 | fd_flags(log)[rows] << 1
        records["valid"] = log.length[rows]
    return records


def _write_container(file: BinaryIO, objects: memoryview) -> None:
    packed = zlib.compress(objects, 1)
    file.write(struct.pack("<4sHHLL", b"LOBJ", 16, VERSION, 32 + len(packed), LOG_CONTAINER))
    file.write(struct.pack("<H6xL4x", DEFLATED, len(objects)))
    file.write(packed)
    file.write(bytes(len(packed) % 4))


def _file_header(size: int, unpacked: int, count: int, start: int, end: int) -> bytes:
    head = struct.pack(
        "<4sLBBBBBBBBQQLL", b"LOGG", FILE_HEADER, 5, 0, 0, 0, 2, 6, 8, 1, size, unpacked, count, 0
    )
    return (head + _system_time(start) + _system_time(end)).ljust(FILE_HEADER, b"\0")


def _system_time(time_ns: int) -> bytes:
    """Windows' SYSTEMTIME as bytes; zeros for a time that is no date."""
    if time_ns < YEAR_1990:
        return bytes(16)
    t = datetime.fromtimestamp(time_ns // 1_000_000_000, UTC)
    milliseconds = time_ns // MILLISECOND % 1000
    return struct.pack(
        "<8H", t.year, t.month, t.isoweekday() % 7, t.day, t.hour, t.minute, t.second, milliseconds
    )
