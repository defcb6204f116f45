"""Read candump text into columns of frames, in order of time."""

import math
import os
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.candump_line import EXPECTED
from slipbench.protocol.logs.candump_text import DATA, KINDS, TextColumns, line_at, parse_text
from slipbench.protocol.logs.frame_log import FrameLog
from slipbench.protocol.logs.reading import Progress, quiet
from slipbench.protocol.user_file import open_user_file

PIECE = 8_000_000  # bytes read at once: some 170 000 lines
TURNS = 20_000_000  # ns; a logger that reads several buses in turn mixes their frames up so far
LONGEST = 2 * PIECE  # bytes of a line: the padding of a torn end; memory stays bounded


def candump_pieces(
    path: Path, progress: Progress = quiet, size: int = PIECE, expected: str = EXPECTED
) -> Iterator[bytes]:
    """Pieces of a text file, of about `size` bytes; each but the last ends at a line's end.

    Raises InputError, which names the `expected` form of a line, for a file without line ends.
    """
    done, remainder = 0, b""
    with open_user_file(path) as file:
        total = max(os.fstat(file.fileno()).st_size, 1)
        while piece := file.read(size):
            done += len(piece)
            complete, newline, remainder = (remainder + piece).rpartition(b"\n")
            progress(done / total)
            if newline:
                yield complete + newline
            elif len(remainder) > LONGEST:
                raise InputError(
                    "this is no text of lines",
                    where=str(path),
                    expected=expected,
                    found=f"no line end in {len(remainder):,} bytes",
                    remedy="is it a log, and whole?",
                )
    if remainder:
        yield remainder


def parse_pieces(pieces: Iterable[bytes], where: str, warnings: list[str]) -> FrameLog:
    """Columns of all frames in candump text.

    An incomplete last line is dropped with a warning. Raises InputError for any other line that is
    no frame.
    """
    return next(parse_portions(pieces, where, warnings))


def parse_portions(
    pieces: Iterable[bytes], where: str, warnings: list[str], at_once: float = math.inf
) -> Iterator[FrameLog]:
    """Frames of candump text in portions of `at_once` lines or a few more; at least one portion.

    Each portion is in order of time; a step back from one to the next gives a warning. Later
    portions may have more buses than earlier ones, at the same numbers. Raises InputError for a
    line that is no frame.
    """
    buses: list[bytes] = []
    parts: list[TextColumns] = []
    lines = held = 0
    reached = -math.inf
    for piece in pieces:
        piece = _without_torn_end(piece, lines, where, warnings)
        text = np.frombuffer(piece, np.uint8)
        part = parse_text(text, buses)
        if part.bad_line is not None:
            raise _not_a_frame(line_at(text, part.bad_line), lines + part.bad_line + 1, where)
        lines += part.kind.size
        held += part.kind.size
        parts.append(part)
        if held >= at_once:
            portion = _portion(parts, buses, where, warnings)
            reached = _warn_of_steps_back(portion, reached, where, warnings)
            yield portion
            parts, held = [], 0
    if parts or not lines:
        portion = _portion(parts, buses, where, warnings)
        _warn_of_steps_back(portion, reached, where, warnings)
        yield portion


def _portion(
    parts: list[TextColumns], buses: list[bytes], where: str, warnings: list[str]
) -> FrameLog:
    if len(buses) > 256:
        raise InputError("more than 256 buses", where=where, found=f"{len(buses)} bus names")
    return _in_order(_join(parts, buses), where, warnings)


def _warn_of_steps_back(log: FrameLog, reached: float, where: str, warnings: list[str]) -> float:
    """Latest time so far, ns; a warning where this portion begins before `reached`."""
    if not len(log):
        return reached
    if log.time_ns[0] < reached:
        warnings.append(
            f"{where}: not in order of time: a step back of"
            f" {(reached - float(log.time_ns[0])) * 1e-9:g} s far into the log stays as it is"
        )
    return max(reached, float(log.time_ns[-1]))


def _without_torn_end(piece: bytes, before: int, where: str, warnings: list[str]) -> bytes:
    """Piece without a last line that was cut while it was written (NUL bytes: padding).

    before: lines that were read before this piece.
    """
    if piece.endswith(b"\n"):
        return piece
    complete, newline, last = piece.rpartition(b"\n")
    last_line = last.rstrip(b"\0")
    if parse_text(np.frombuffer(last_line, np.uint8), []).bad_line is None:
        if last_line.strip():
            warnings.append(f"{where}: the last line has no line end; it is read as it is")
        return complete + newline + last_line
    if not newline and not before:
        return piece  # nothing but one unreadable line: not a torn log, another kind of file
    warnings.append(f"{where}: the last line is incomplete and omitted: {_shown(last_line)}")
    return complete + newline


def _not_a_frame(line: bytes, number: int, where: str) -> InputError:
    from slipbench.protocol.logs.formats import FORMATS, looks_like

    other = looks_like(line)
    hint = f", as in {FORMATS[other].title}: two formats in one file?" if other else ""
    return InputError(
        "this line is not a frame of candump text",
        where=f"{where}: line {number}",
        expected=EXPECTED,
        found=_shown(line) + hint,
        remedy="correct or delete that line in a copy of the log; no file was written",
    )


def _shown(line: bytes) -> str:
    text = line[:80].decode("ascii", errors="backslashreplace")
    return repr(text) + ("..." if len(line) > 80 else "")


def _join(parts: list[TextColumns], buses: list[bytes]) -> FrameLog:
    kinds = np.concatenate([part.kind for part in parts] or [np.zeros(0, np.uint8)])
    skipped = tuple(
        (name, int(count)) for kind, name in KINDS.items() if (count := np.sum(kinds == kind))
    )
    width = max((part.data.shape[1] for part in parts), default=8)
    data = np.zeros((int(np.sum(kinds == DATA)), width), np.uint8)
    rows = [part.kind == DATA for part in parts]
    first = 0
    for part, keep in zip(parts, rows, strict=True):
        last = first + int(keep.sum())
        data[first:last, : part.data.shape[1]] = part.data[keep]
        first = last

    def column(name: str, dtype: type[np.generic]) -> np.ndarray:
        empty = [np.zeros(0, dtype)]
        found = [getattr(part, name)[keep] for part, keep in zip(parts, rows, strict=True)]
        return np.concatenate(found or empty).astype(dtype, copy=False)

    return FrameLog(
        column("time_ns", np.int64),
        column("bus", np.uint8),
        column("identifier", np.uint32),
        column("extended", np.bool_),
        column("fd", np.bool_),
        column("sent", np.bool_),
        column("length", np.uint8),
        data,
        tuple(bus.decode("utf-8", errors="backslashreplace") for bus in buses),
        skipped,
        column("fd_flags", np.uint8),
    )


def _in_order(log: FrameLog, where: str, warnings: list[str]) -> FrameLog:
    """Frames sorted by time, stable; a warning where that changes their order.

    No warning where each bus is in order, and only buses that were read in turn are not.
    """
    steps = np.diff(log.time_ns)
    back = np.flatnonzero(steps < 0)
    if not back.size:
        return log
    if steps.min() >= -TURNS and _each_in_order(log):
        return log.select(np.argsort(log.time_ns, kind="stable"))
    largest = -float(steps[back].min()) * 1e-9
    doubt = "; two recordings in one file?" if largest > 1.0 else ""
    warnings.append(
        f"{where}: not in order of time: {back.size} steps back, the largest {largest:g} s, the"
        f" first at frame {back[0] + 2} ({log.time_ns[back[0] + 1] * 1e-9:.6f} s); sorted{doubt}"
    )
    return replace(log.select(np.argsort(log.time_ns, kind="stable")))


def _each_in_order(log: FrameLog) -> bool:
    """Whether the frames of each bus are in order of time."""
    return all(
        bool((np.diff(log.time_ns[log.bus == bus]) >= 0).all()) for bus in range(len(log.buses))
    )
