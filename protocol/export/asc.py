"""Export as Vector ASC: one line of text per frame, times relative to the file's date.

The layout is that of python-can's writer, which reads it back in the tests. The date has whole
milliseconds of the local time zone, as Vector's own files; it is put on the millisecond before the
first frame, so that no frame is moved.
"""

from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.database.layout import Database
from slipbench.protocol.export.lengths import dlc, fd_flags
from slipbench.protocol.extras import optional_library
from slipbench.protocol.logs.decode import SortedLog
from slipbench.protocol.logs.frame_log import FrameLog

MILLISECOND, SECOND = 1_000_000, 1_000_000_000  # ns
AT_ONCE = 50_000  # lines
HEXADECIMAL = np.array([list(b"%02X " % byte) for byte in range(256)], np.uint8)  # (256, 3)


def write_asc(portions: Iterator[SortedLog], _database: Database, path: Path) -> int:
    """Write the raw frames; this format holds no decoded signals."""
    start: int | None = None
    with path.open("wb") as file:
        for log in (portion.log for portion in portions if len(portion.log)):
            if start is None:
                start = int(log.time_ns[0]) // MILLISECOND * MILLISECOND
                file.write(_head(_date(start)).encode("ascii"))
            for first in range(0, len(log), AT_ONCE):
                rows = np.arange(first, min(first + AT_ONCE, len(log)))
                file.write(_text(log.select(rows), start))
        file.write(b"End TriggerBlock\n")
    return 0


def _head(date: str) -> str:
    return (
        f"date {date}\nbase hex  timestamps absolute\ninternal events logged\n"
        f"Begin Triggerblock {date}\n 0.000000 Start of measurement\n"
    )


def _date(time_ns: int) -> str:
    """Date as Vector writes it, with English names in every locale."""
    t = datetime.fromtimestamp(time_ns // SECOND)
    day = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")[t.weekday()]
    month = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")[
        t.month - 1
    ]
    clock = f"{t:%H:%M:%S}.{time_ns // MILLISECOND % 1000:03d}"
    return f"{day} {month} {t.day:02d} {clock} {t.year}"


def _text(log: FrameLog, start: int) -> memoryview:
    """Lines of frames: time stamp, text before the payload, payload, text after it.

    Arrow joins the columns, and the strings of an array lie one after the other.
    """
    pa = optional_library("pyarrow")
    compute = optional_library("pyarrow.compute")

    _, first, kind = np.unique(_kinds(log), return_index=True, return_inverse=True)
    heads, tails = zip(*(_around(log, row) for row in first.tolist()), strict=True)
    columns = (
        _stamps(log.time_ns - start),
        pa.array(heads).take(kind),
        _payloads(log),
        pa.array(tails).take(kind),
        "",
    )
    _, offsets, text = compute.binary_join_element_wise(*columns).buffers()
    ends = np.frombuffer(offsets, np.int32, len(log) + 1)
    return memoryview(text)[ends[0] : ends[-1]]


def _kinds(log: FrameLog) -> npt.NDArray[np.int64]:
    """Number of each frame's kind: frames of one kind differ in time and payload only."""
    kind = log.identifier.astype(np.int64)
    for column, bits in (
        (log.extended, 1),
        (log.fd, 1),
        (log.sent, 1),
        (log.length, 7),
        (fd_flags(log), 2),
        (log.bus, 8),
    ):
        kind = kind << bits | column
    return kind


def _around(log: FrameLog, row: int) -> tuple[str, str]:
    """Text before and after the payload of a frame."""
    direction, code = "Tx" if log.sent[row] else "Rx", dlc(log)[row]
    name = f"{log.identifier[row]:X}{'x' if log.extended[row] else ''}"
    if not log.fd[row]:
        return f" {log.bus[row] + 1}  {name:<15} {direction:<4} d {code:x} ", "\n"
    switched, error = fd_flags(log)[row] & 1, fd_flags(log)[row] >> 1 & 1
    head = (
        f" CANFD {log.bus[row] + 1:>3} {direction:<4} {name:>8} {'':>32} {switched} {error}"
        f" {code:x} {log.length[row]:>2} "
    )
    flags = 0x1000 | int(switched) << 13 | int(error) << 14
    return head, f" {0:>8} {0:>4} {flags:>8X}" + f" {0:>8}" * 5 + "\n"


def _stamps(since: npt.NDArray[np.int64]) -> Any:
    """Times (ns) as text in s, to the microsecond where that is exact, 12 characters wide."""
    pa = optional_library("pyarrow")
    compute = optional_library("pyarrow.compute")

    seconds, remainder = np.divmod(since, SECOND)
    exact = remainder % 1000 == 0
    digits = pa.array(np.where(exact, remainder // 1000, remainder)).cast(pa.string())
    padded = compute.if_else(
        exact, compute.utf8_lpad(digits, 6, "0"), compute.utf8_lpad(digits, 9, "0")
    )
    full_seconds = pa.array(seconds).cast(pa.string())
    return compute.utf8_lpad(compute.binary_join_element_wise(full_seconds, padded, "."), 12)


def _payloads(log: FrameLog) -> Any:
    """Payloads as text: hexadecimal bytes separated by spaces."""
    pa = optional_library("pyarrow")

    digits = HEXADECIMAL[log.data].reshape(len(log), -1)
    size = np.maximum(3 * log.length.astype(np.int32) - 1, 0)
    ends = np.concatenate([[0], np.cumsum(size)]).astype(np.int32)
    text = digits[np.arange(digits.shape[1]) < size[:, None]]
    return pa.StringArray.from_buffers(len(log), pa.py_buffer(ends), pa.py_buffer(text))
