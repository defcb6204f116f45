"""A recording as Vector ASC: one line of text a frame, times relative to the file's date.

The layout is that of python-can's writer, which reads it back in the tests. The date has whole
milliseconds of the local time zone, as Vector's own files; it is put on the millisecond before the
first frame, so that no frame is moved.
"""

from collections.abc import Iterator
from datetime import datetime
from itertools import islice
from pathlib import Path

from protocol.decode import SortedLog
from protocol.export.lengths import dlc, fd_flags
from protocol.frame_log import FrameLog
from protocol.layout import Database

MILLISECOND, SECOND = 1_000_000, 1_000_000_000  # ns
AT_ONCE = 50_000  # lines


def write_asc(sorted_log: SortedLog, _database: Database, path: Path) -> int:
    """Write the raw frames; decoded signals have no place in this format."""
    log = sorted_log.log
    start = int(log.time_ns[0]) // MILLISECOND * MILLISECOND
    date = _date(start)
    lines = _lines(log, start)
    with path.open("w", encoding="ascii", newline="\n") as file:
        file.write(f"date {date}\nbase hex  timestamps absolute\ninternal events logged\n")
        file.write(f"Begin Triggerblock {date}\n 0.000000 Start of measurement\n")
        while piece := "".join(islice(lines, AT_ONCE)):
            file.write(piece)
        file.write("End TriggerBlock\n")
    return 0


def _date(time_ns: int) -> str:
    """Write a time as Vector does; English names whatever the locale."""
    t = datetime.fromtimestamp(time_ns // SECOND)
    day = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")[t.weekday()]
    month = ("Jan", "Feb", "Mar", "Apr", "May", "Jun",
             "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")[t.month - 1]  # fmt: skip
    clock = f"{t:%H:%M:%S}.{time_ns // MILLISECOND % 1000:03d}"
    return f"{day} {month} {t.day:02d} {clock} {t.year}"


def _lines(log: FrameLog, start: int) -> Iterator[str]:
    payload, width = log.data.tobytes(), log.data.shape[1]
    columns = (
        log.time_ns, log.bus, log.identifier, log.extended, log.fd, log.sent, log.length,
        dlc(log), fd_flags(log),
    )  # fmt: skip
    rows = zip(*(column.tolist() for column in columns), strict=True)
    for row, (time, bus, identifier, extended, fd, sent, length, code, flags) in enumerate(rows):
        seconds, rest = divmod(time - start, SECOND)
        stamp = f"{seconds}.{rest:09d}" if rest % 1000 else f"{seconds}.{rest // 1000:06d}"
        name = f"{identifier:X}{'x' if extended else ''}"
        direction = "Tx" if sent else "Rx"
        data = payload[row * width : row * width + length].hex(" ").upper()
        if fd:
            yield (
                f"{stamp:>12} CANFD {bus + 1:>3} {direction:<4} {name:>8} {'':>32} {flags & 1} "
                f"{flags >> 1 & 1} {code:x} {length:>2} {data} {0:>8} {0:>4} "
                f"{0x1000 | (flags & 1) << 13 | (flags >> 1 & 1) << 14:>8X} {0:>8} {0:>8} "
                f"{0:>8} {0:>8} {0:>8}\n"
            )
        else:
            yield f"{stamp:>12} {bus + 1}  {name:<15} {direction:<4} d {code:x} {data}\n"
