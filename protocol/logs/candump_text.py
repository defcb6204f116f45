"""Candump text to columns, many lines at once.

Lines of one length that differ only in digits share a shape. The first line that is not yet
understood is read by the regular expression; it gives the shape, and every other line of that shape
is then read by NumPy. A log has a few dozen shapes, so few lines are ever read one by one.
"""

import re
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from slipbench.protocol.logs.candump_line import ERROR_FLAG, IDENTIFIER_MASK, LATEST_SECOND, LINE

Bytes = npt.NDArray[np.uint8]
Rows = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]

BLANK, DATA, REMOTE, ERROR, COMMENT = range(5)
KINDS = {REMOTE: "remote frames", ERROR: "error frames", COMMENT: "comments"}

_NOT_HEX = 255
_DIGIT = np.full(256, _NOT_HEX, np.uint8)
for _value, _character in enumerate(b"0123456789abcdef"):
    _DIGIT[_character] = _DIGIT[ord(chr(_character).upper())] = _value

_BLANK_LINE = re.compile(rb"\s*")


@dataclass(frozen=True)
class TextColumns:
    """The lines of a piece of text, in their order; `kind` says which of them are data frames."""

    kind: Bytes
    time_ns: npt.NDArray[np.int64]
    bus: npt.NDArray[np.int16]
    identifier: npt.NDArray[np.uint32]
    extended: Mask
    fd: Mask
    fd_flags: Bytes
    sent: Mask
    length: Bytes
    data: Bytes
    bad_line: int | None = None  # first line that is none of this, counted from 0


def parse_text(text: Bytes, buses: list[bytes]) -> TextColumns:
    """Read whole lines. New bus names are appended to `buses`."""
    starts, lengths = _lines(text)
    columns = _empty(len(starts), width=64 if _has_fd(text) else 8)
    bad = [
        found
        for length in np.unique(lengths)
        if (found := _parse_length(text, starts, lengths, int(length), columns, buses)) is not None
    ]
    return replace(columns, bad_line=min(bad, default=None))


def line_at(text: Bytes, number: int) -> bytes:
    """Give line `number`, counted from 0, of `text`."""
    starts, lengths = _lines(text)
    return text[starts[number] : starts[number] + lengths[number]].tobytes()


def _lines(text: Bytes) -> tuple[Rows, Rows]:
    ends = np.flatnonzero(text == ord("\n"))
    if text.size and text[-1] != ord("\n"):
        ends = np.append(ends, text.size)
    starts = np.concatenate([[0], ends[:-1] + 1]).astype(np.intp)[: ends.size]
    return starts, ends - starts


def _has_fd(text: Bytes) -> bool:
    return bool(np.any((text[:-1] == ord("#")) & (text[1:] == ord("#"))))


def _empty(count: int, width: int) -> TextColumns:
    return TextColumns(
        kind=np.zeros(count, np.uint8),
        time_ns=np.zeros(count, np.int64),
        bus=np.zeros(count, np.int16),
        identifier=np.zeros(count, np.uint32),
        extended=np.zeros(count, np.bool_),
        fd=np.zeros(count, np.bool_),
        fd_flags=np.zeros(count, np.uint8),
        sent=np.zeros(count, np.bool_),
        length=np.zeros(count, np.uint8),
        data=np.zeros((count, width), np.uint8),
    )


def _parse_length(
    text: Bytes, starts: Rows, lengths: Rows, length: int, into: TextColumns, buses: list[bytes]
) -> int | None:
    """Read all lines of one length; returns the first that cannot be read, if any."""
    pending = np.flatnonzero(lengths == length)
    if length == 0:
        return None
    rows = np.lib.stride_tricks.sliding_window_view(text, length)[starts[pending]]
    digits = _DIGIT[rows]
    while pending.size:
        sample = rows[0].tobytes()
        shape = _Shape.of(sample, buses)
        if shape is None:
            return int(pending[0])
        alike = shape.matches(rows, digits)
        shape.fill(digits[alike], pending[alike], into)
        if alike.all():
            return None
        pending, rows, digits = pending[~alike], rows[~alike], digits[~alike]
    return None


@dataclass(frozen=True)
class _Shape:
    """Where the fields of a line stand; every other character is fixed."""

    line: Bytes
    kind: int
    bus: int = 0
    seconds: tuple[int, int] = (0, 0)
    fraction: tuple[int, int] = (0, 0)
    identifier: tuple[int, int] = (0, 0)
    payload: tuple[int, int] = (0, 0)
    fd_flags: int = -1  # of a CAN FD frame; no digit of `matches`: other flags, another shape
    sent: bool = False

    @staticmethod
    def of(line: bytes, buses: list[bytes]) -> "_Shape | None":
        """Take the shape of one line; None: it is neither a frame, nor blank, nor a comment."""
        fixed = np.frombuffer(line, np.uint8)
        if _BLANK_LINE.fullmatch(line):
            return _Shape(fixed, BLANK)
        if line.startswith(b"#"):
            return _Shape(fixed, COMMENT)
        match = LINE.fullmatch(line)
        if match is None or int(match["seconds"]) > LATEST_SECOND:
            return None
        if match["bus"] not in buses:
            buses.append(match["bus"])
        payload = "fd" if match["fd"] is not None else "classic"
        return _Shape(
            fixed,
            REMOTE if match["remote"] else DATA,
            buses.index(match["bus"]),
            match.span("seconds"),
            match.span("fraction"),
            match.span("identifier"),
            (0, 0) if match["remote"] else match.span(payload),
            int(match["flags"], 16) if payload == "fd" else -1,
            match["direction"] in (b"T", b"t"),
        )

    def matches(self, rows: Bytes, digits: Bytes) -> Mask:
        """Tell which lines have this shape, and digits where this one has fields."""
        if self.kind == COMMENT:
            return np.asarray(rows[:, 0] == ord("#"))
        decimal, hexadecimal = (self.seconds, self.fraction), (self.identifier, self.payload)
        fixed = np.ones(rows.shape[1], np.bool_)
        for first, last in (*decimal, *hexadecimal):
            fixed[first:last] = False
        same = np.asarray((rows[:, fixed] == self.line[fixed]).all(axis=1))
        for fields, base in ((decimal, 10), (hexadecimal, 16)):
            for first, last in fields:
                same &= (digits[:, first:last] < base).all(axis=1)
        return same & self._in_range(digits)

    def _in_range(self, digits: Bytes) -> Mask:
        """A second that 64 bits hold, and at most 7FF where the identifier has three digits."""
        fits = np.ones(len(digits), np.bool_)
        if _width(self.seconds) == 10:
            fits &= _number(digits, self.seconds, 10) <= LATEST_SECOND
        if _width(self.identifier) == 3:
            fits &= digits[:, self.identifier[0]] < 8
        return fits

    def fill(self, digits: Bytes, lines: Rows, into: TextColumns) -> None:
        """Read the fields of all `lines` that have this shape."""
        into.kind[lines] = self.kind
        if self.kind in (BLANK, COMMENT):
            return
        fraction = _number(digits, self.fraction, 10) * 10 ** (9 - _width(self.fraction))
        into.time_ns[lines] = _number(digits, self.seconds, 10) * 1_000_000_000 + fraction
        identifier, extended = _number(digits, self.identifier, 16), _width(self.identifier) == 8
        if extended:
            into.kind[lines[(identifier & ERROR_FLAG) != 0]] = ERROR
        into.identifier[lines] = identifier & IDENTIFIER_MASK
        into.extended[lines], into.bus[lines] = extended, self.bus
        into.fd[lines], into.sent[lines] = self.fd_flags >= 0, self.sent
        into.fd_flags[lines] = max(self.fd_flags, 0)
        size = _width(self.payload) // 2
        payload = digits[:, slice(*self.payload)]
        into.length[lines] = size
        into.data[lines, :size] = (payload[:, 0::2] << 4) | payload[:, 1::2]


def _width(field: tuple[int, int]) -> int:
    return field[1] - field[0]


def _number(digits: Bytes, field: tuple[int, int], base: int) -> npt.NDArray[np.int64]:
    """Value of the digits in `field` of each row, most significant first."""
    total = np.zeros(len(digits), np.int64)
    for column in range(*field):
        total = total * base + digits[:, column]
    return total
