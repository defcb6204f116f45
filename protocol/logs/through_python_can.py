"""Read logs by python-can: Vector ASC and BLF, PCAN traces, python-can's own CSV.

Each is turned into candump text, frame by frame, error and remote frames included. A line of a text
format that gives no frame is either known to hold none (a header, a comment, a bus event; events
are counted in a warning) or it is an error; python-can itself skips such lines without a message.
"""

import io
import logging
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.blf_containers import check_containers
from slipbench.protocol.logs.candump_line import ERROR_FLAG, format_line, stamp
from slipbench.protocol.logs.formats import FORMATS, looks_like, read_head
from slipbench.protocol.logs.reading import Progress
from slipbench.protocol.user_file import open_user_file

if TYPE_CHECKING:
    import can

_LINES_AT_ONCE = 5000
_RELATIVE = re.compile(rb"timestamps\s+relative", re.IGNORECASE)

# Lines without a frame: what carries none by nature, and bus events that are counted.
_SILENT = {
    "asc": re.compile(
        r"\s*$|\s*//|date\s|base\s|(?:no\s+)?internal events|(?:Begin|End) TriggerBlock"
        r"|\s*[\d.]+\s+(?:Start of measurement|previous log file)",
        re.IGNORECASE,
    ),
    "trc": re.compile(r"\s*$|\s*;"),
    "can-csv": re.compile(r"\s*$|timestamp,"),
}
_EVENT = {
    "asc": re.compile(r"\s*\d+\.\d+\s"),
    "trc": re.compile(r"\s*\d+\)?\s+\d+\.?\d*\s"),
    "can-csv": re.compile(r"(?!)"),
}


def python_can_pieces(
    path: Path, form: str, warnings: list[str], progress: Progress
) -> Iterator[bytes]:
    """A log of the format `form`, a key of FORMATS, as pieces of candump text.

    Raises InputError where the file is damaged, or its times are relative.
    """
    if form == "asc" and _RELATIVE.search(read_head(path)):
        raise InputError(
            "its times are relative, each to the line before",
            where=str(path),
            expected="timestamps absolute",
            found="timestamps relative",
            remedy="save it with absolute time stamps: events that are no frames count as well",
        )
    source = _Source(path, form, warnings)
    lines: list[bytes] = []
    for message in source.messages():
        lines.append(_line(message))
        if len(lines) >= _LINES_AT_ONCE:
            progress(source.share())
            yield b"".join(lines)
            lines = []
    yield b"".join(lines)
    source.finish()


def _line(message: "can.Message") -> bytes:
    """One message of python-can as a line; its times are floats, exact to a microsecond."""
    time_ns = round(message.timestamp * 1e6) * 1000
    channel = message.channel
    bus = channel if isinstance(channel, str) and not channel.isdigit() else f"can{channel or 0}"
    if message.is_error_frame:
        return f"({stamp(time_ns)}) {bus} {ERROR_FLAG | 0x80:08X}#\n".encode("ascii")
    if message.is_remote_frame:
        width = 8 if message.is_extended_id else 3
        head = f"({stamp(time_ns)}) {bus} {message.arbitration_id:0{width}X}#R{message.dlc:X}"
        return (head + ("\n" if message.is_rx else " T\n")).encode("ascii")
    flags = message.bitrate_switch + 2 * message.error_state_indicator if message.is_fd else None
    return format_line(
        time_ns,
        bus.replace(" ", "_"),
        message.arbitration_id,
        bytes(message.data),
        extended=message.is_extended_id,
        fd_flags=flags,
        sent=not message.is_rx,
    )


class _Source:
    """One file with its python-can reader, and a check of the lines that the reader skips."""

    def __init__(self, path: Path, form: str, warnings: list[str]) -> None:
        self._path, self._form, self._warnings = path, form, warnings
        self._lines = None if form == "blf" else _CountedLines(path)
        self._events = 0
        self._first_event = ""
        self._frames = 0

    def share(self) -> float:
        """Share of the file read so far; 0 for a binary file, where it is unknown."""
        return self._lines.share() if self._lines else 0.0

    def messages(self) -> Iterator["can.Message"]:
        """Every message. Raises InputError, naming the line, where the file is damaged."""
        captured = _CapturedWarnings()
        logging.getLogger("can").addHandler(captured)
        try:
            for message in self._reader():
                self._frames += 1
                self._look_at_passed_over_lines(frame=True)
                yield message
            self._look_at_passed_over_lines(frame=False)
        except InputError:
            raise
        except Exception as cause:  # python-can passes on any exception of its parsing
            if not self._ends_early():
                raise self._unreadable(cause) from cause
        finally:
            logging.getLogger("can").removeHandler(captured)
            if self._lines:
                self._lines.close()
        self._warnings.extend(f"{self._path}: {text}" for text in captured.texts)

    def _reader(self) -> Any:
        import can

        if self._form == "blf":
            check_containers(self._path)
            return can.BLFReader(self._path)
        file: Any = self._lines
        if self._form == "asc":
            return can.ASCReader(file, relative_timestamp=False)
        return can.TRCReader(file) if self._form == "trc" else can.CSVReader(file)

    def _look_at_passed_over_lines(self, frame: bool) -> None:
        """Check the lines that python-can consumed since the last frame."""
        if self._lines is None:
            return
        passed = self._lines.take()
        for number, line in passed[:-1] if frame else passed:
            if _SILENT[self._form].match(line):
                continue
            if not _EVENT[self._form].match(line):
                raise self._garbage(number, line)
            self._events += 1
            self._first_event = self._first_event or f"line {number}: {line.strip()[:80]!r}"

    def _garbage(self, number: int, line: str) -> InputError:
        other = looks_like(line.encode("utf-8"))
        hint = f", as in {FORMATS[other].title}: two formats in one file?" if other else ""
        return InputError(
            f"this line is not valid in {FORMATS[self._form].title}",
            where=f"{self._path}: line {number}",
            found=repr(line.strip()[:80]) + hint,
            remedy="correct or delete that line in a copy of the log",
        )

    def _unreadable(self, cause: Exception) -> InputError:
        line = f": line {self._lines.number}" if self._lines else ""
        found = f"{type(cause).__name__}: {cause}" if str(cause) else type(cause).__name__
        if self._lines and self._lines.last.strip():
            found += f" in {self._lines.last.strip()[:80]!r}"
        return InputError(
            f"python-can cannot read this as {FORMATS[self._form].title}",
            where=f"{self._path}{line}",
            expected="a whole, undamaged file",
            found=f"{found}, after {self._frames} good frames",
            remedy="cut the file before that position, or repair it with the program that wrote it",
        )

    def finish(self) -> None:
        """Add warnings for omitted events and for a file that ends too early."""
        if self._events:
            self._warnings.append(
                f"{self._path}: {self._events} events are no frames and are omitted;"
                f" the first at {self._first_event}"
            )
        if (missing := self._ends_early()) > 0:
            self._warnings.append(
                f"{self._path}: truncated: {missing} bytes that its header states are missing;"
                f" the {self._frames} frames before the cut are kept"
            )

    def _ends_early(self) -> int:
        """Number of bytes that the header of a BLF file states and the file lacks."""
        if self._form != "blf":
            return 0
        with open_user_file(self._path) as file:
            declared = int.from_bytes(file.read(24)[16:24], "little")
        return max(declared - self._path.stat().st_size, 0)


class _CountedLines:
    """Text file for python-can's readers that records which line was read last."""

    def __init__(self, path: Path) -> None:
        self._raw = open_user_file(path)
        self._size = max(os.fstat(self._raw.fileno()).st_size, 1)
        self._text = io.TextIOWrapper(self._raw, encoding="utf-8-sig", errors="replace")
        self._fresh: list[tuple[int, str]] = []
        self.number, self.last = 0, ""

    def __iter__(self) -> "_CountedLines":
        return self

    def __next__(self) -> str:
        self.last = next(self._text)
        self.number += 1
        self._fresh.append((self.number, self.last))
        return self.last

    def take(self) -> list[tuple[int, str]]:
        """Number and text of the lines read since the last call."""
        fresh, self._fresh = self._fresh, []
        return fresh

    def share(self) -> float:
        """Share of the file read so far."""
        return min(self._raw.tell() / self._size, 1.0)

    def read(self, size: int = -1) -> str:
        """Text of at most `size` characters; python-can accepts no file without this method."""
        return self._text.read(size)

    def close(self) -> None:
        """Close the file."""
        self._text.close()


class _CapturedWarnings(logging.Handler):
    """Warnings of python-can, each text once."""

    def __init__(self) -> None:
        super().__init__(level=logging.WARNING)
        self.texts: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        """Keep the text of a warning."""
        if len(self.texts) < 20 and (text := record.getMessage()) not in self.texts:
            self.texts.append(text)
