"""Lines of a recorded file up to a time, with a seek by bisection: the clock of a replay."""

import os
from collections.abc import Callable
from pathlib import Path

TimeOf = Callable[[bytes], int]


def frame_time(line: bytes) -> int:
    """Time of a line of candump text, ns. Raises ValueError where it has none."""
    seconds, _, fraction = line[line.index(b"(") + 1 : line.index(b")")].partition(b".")
    return int(seconds) * 1_000_000_000 + int(fraction.ljust(9, b"0"))


def tick_time(line: bytes) -> int:
    """Time at which a tick of ticks.csv was due, ns. Raises ValueError where it has none."""
    return int(line.split(b",", 2)[1])


class TimedLines:
    """A file whose lines are in order of time."""

    def __init__(self, path: Path, time_of: TimeOf) -> None:
        """Open the file at its first line. Raises OSError where it cannot be read."""
        self._file, self._time_of = path.open("rb"), time_of
        self._held = b""

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def until(self, time_ns: int) -> bytes:
        """Lines from here on up to a time (ns); what is no line with a time is dropped."""
        lines = []
        while line := self._held or self._file.readline():
            self._held = b""
            try:
                later = self._time_of(line) > time_ns
            except ValueError:
                continue
            if later:
                self._held = line
                break
            lines.append(line)
        return b"".join(lines)

    def seek(self, time_ns: int) -> None:
        """Go to the first line at or after a time (ns)."""
        low, high = 0, self._file.seek(0, os.SEEK_END)
        while low < high:
            middle = (low + high) // 2
            found = self._line_after(middle)
            if found is None or found[1] >= time_ns:
                high = middle
            else:
                low = middle + 1
        self._line_after(low)
        self._held = b""
        self._file.seek(self._begin_of_line(low))

    def _begin_of_line(self, offset: int) -> int:
        found = self._line_after(offset)
        return self._file.seek(0, os.SEEK_END) if found is None else found[0]

    def _line_after(self, offset: int) -> tuple[int, int] | None:
        """Offset and time (ns) of the first line with a time that begins at or after an offset."""
        self._file.seek(max(0, offset - 1))
        if offset:
            self._file.readline()
        while True:
            begin = self._file.tell()
            line = self._file.readline()
            if not line:
                return None
            try:
                return begin, self._time_of(line)
            except ValueError:
                continue

    def bounds(self) -> tuple[int, int]:
        """Time of the first and of the last line, ns. Raises ValueError where no line has one."""
        first = self._line_after(0)
        end = self._file.seek(0, os.SEEK_END)
        back = 4096
        last = self._line_after(max(0, end - back))
        if first is None or last is None:
            raise ValueError("no line has a time")
        latest = last[1]
        for line in self._file.read().splitlines():
            try:
                latest = self._time_of(line)
            except ValueError:
                continue
        self._file.seek(0)
        return first[1], latest
