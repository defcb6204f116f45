"""Read logs of raw frames, in the formats that loggers write, as columns of frames.

Every log is first candump text: other formats are converted line by line by the libraries that know
them, and one reader turns the text into columns. So an imported recording keeps, as plain text, the
very frames that were analysed.

    reading = read_log(Path("drive.asc"))
    reading.frames.time_ns, reading.frames.identifier, reading.warnings
"""

from collections.abc import Iterator
from pathlib import Path

from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.candump import candump_pieces, parse_pieces, parse_portions
from slipbench.protocol.logs.formats import FORMATS, looks_like, read_head, refusal
from slipbench.protocol.logs.frame_log import FrameLog
from slipbench.protocol.logs.reading import LogReading, LogText, Progress, quiet

__all__ = [
    "LogReading",
    "LogText",
    "Progress",
    "open_log",
    "quiet",
    "read_log",
    "read_portions",
    "unknown_format",
]


def read_log(path: Path, progress: Progress = quiet) -> LogReading:
    """All data frames of a log, in order of time. Raises InputError if there are none."""
    text = open_log(path, progress)
    frames = parse_pieces(text.pieces, str(path), text.warnings)
    if not len(frames):
        raise no_frames(path, text.format, frames.skipped)
    return LogReading(frames, text.format, tuple(text.warnings))


def read_portions(
    path: Path, at_once: int, progress: Progress = quiet
) -> tuple[LogText, Iterator[FrameLog]]:
    """Frames of a log in portions of about `at_once`: memory does not grow with its length."""
    text = open_log(path, progress)
    return text, parse_portions(text.pieces, str(path), text.warnings, at_once)


def no_frames(path: Path, form: str, skipped: tuple[tuple[str, int], ...]) -> InputError:
    """Error that a log has no data frame, with what it has instead."""
    beside = ", ".join(f"{count} {name}" for name, count in skipped)
    return InputError(
        "the log holds no data frames",
        where=str(path),
        expected="at least one frame",
        found=beside or f"{form} without frames",
        remedy="was the logger on the right bus, at the right bit rate?",
    )


def open_log(path: Path, progress: Progress = quiet) -> LogText:
    """A log of any format as candump text. Raises InputError if it is none, or unreadable."""
    name = looks_like(read_head(path))
    if name is None:
        raise unknown_format(path)
    form = FORMATS[name]
    text = LogText(form.title, iter(()))
    if form.reader == "candump":
        text.pieces = candump_pieces(path, progress)
    elif form.reader == "python-can":
        from slipbench.protocol.logs.through_python_can import python_can_pieces

        text.pieces = python_can_pieces(path, name, text.warnings, progress)
    elif form.reader == "gvret":
        from slipbench.protocol.logs.gvret import gvret_pieces

        text.pieces = gvret_pieces(path, text.warnings, progress)
    elif form.reader == "asammdf":
        from slipbench.protocol.logs.through_asammdf import mdf_pieces

        text.pieces = mdf_pieces(path, text.warnings, progress)
    else:
        raise refusal(name, path) if form.refused else _a_table(path, form.title)
    return text


def _a_table(path: Path, title: str) -> InputError:
    return InputError(
        f"this is a table ({title}), not a log of frames",
        where=str(path),
        remedy="import it with a role map of columns, or beside a log with --table",
    )


def _known(what: str) -> str:
    """Titles of the formats of frames, or of tables, that are read."""
    return ", ".join(
        form.title
        for form in FORMATS.values()
        if form.reader and (form.reader == "table") == (what == "table")
    )


def unknown_format(path: Path) -> InputError:
    """Error that the format of a file is not known, with those that are read."""
    head = read_head(path)
    text = head.decode("utf-8", errors="replace")
    binary = sum(not character.isprintable() for character in text) > len(text) / 10 + 2
    first = "binary data" if binary else repr(next(filter(str.strip, text.splitlines()), "")[:80])
    return InputError(
        "not a log or a table of a format that is known here",
        where=str(path),
        expected=f"{_known('frames')}; or a table: CSV, {_known('table')}",
        found=first,
        remedy="convert it with the program that wrote it, or with SavvyCAN",
    )
