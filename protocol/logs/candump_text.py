"""Parse candump text into columns, many lines at once.

Lines of one length that differ only in digits have the same pattern. A regular expression reads the
first line of each pattern; NumPy reads all others of it. A log has a few dozen patterns.
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
    """The n lines of a piece of text, in order; `kind` (BLANK to COMMENT) marks the data frames."""

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
    """Columns of whole lines of text. New bus names are appended to `buses`.

    text: characters as bytes, shape (m,). A line that is not candump text is reported as `bad_line`.
    """
    starts, lengths = _lines(text)
    columns = _empty(len(starts), width=64 if _has_fd(text) else 8)
    bad = [
        found
        for length in np.unique(lengths)
        if (found := _parse_length(text, starts, lengths, int(length), columns, buses)) is not None
    ]
    return replace(columns, bad_line=min(bad, default=None))


def line_at(text: Bytes, number: int) -> bytes:
    """Line `number`, counted from 0, of `text`: characters as bytes, shape (m,)."""
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
    """Number of the first line of this length that cannot be read, or None; the others are read."""
    pending = np.flatnonzero(lengths == length)
    if length == 0:
        return None
    rows = np.lib.stride_tricks.sliding_window_view(text, length)[starts[pending]]
    digits = _DIGIT[rows]
    while pending.size:
        sample = rows[0].tobytes()
        pattern = _Pattern.of(sample, buses)
        if pattern is None:
            return int(pending[0])
        matching = pattern.matches(rows, digits)
        pattern.fill(digits[matching], pending[matching], into)
        if matching.all():
            return None
        pending, rows, digits = pending[~matching], rows[~matching], digits[~matching]
    return None


@dataclass(frozen=True)
class _Pattern:
    """Positions of the fields in a line; every other character is fixed."""

    line: Bytes
    kind: int
    bus: int = 0
    seconds: tuple[int, int] = (0, 0)
    fraction: tuple[int, int] = (0, 0)
    identifier: tuple[int, int] = (0, 0)
    payload: tuple[int, int] = (0, 0)
    fd_flags: int = -1  # of a CAN FD frame; no digit of `matches`: other flags, another pattern
    sent: bool = False

    @staticmethod
    def of(line: bytes, buses: list[bytes]) -> "_Pattern | None":
        """Pattern of one line; None where it is neither a frame, nor blank, nor a comment."""
        fixed = np.frombuffer(line, np.uint8)
        if _BLANK_LINE.fullmatch(line):
            return _Pattern(fixed, BLANK)
        if line.startswith(b"#"):
            return _Pattern(fixed, COMMENT)
        match = LINE.fullmatch(line)
        if match is None or int(match["seconds"]) > LATEST_SECOND:
            return None
        if match["bus"] not in buses:
            buses.append(match["bus"])
        payload = "fd" if match["fd"] is not None else "classic"
        return _Pattern(
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
        """Whether each line has this pattern, and digits in its fields. rows, digits: (n, length)."""
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
        """Whether 64 bits hold the time, and an identifier of three digits is at most 7FF."""
        fits = np.ones(len(digits), np.bool_)
        if _width(self.seconds) == 10:
            fits &= _number(digits, self.seconds, 10) <= LATEST_SECOND
        if _width(self.identifier) == 3:
            fits &= digits[:, self.identifier[0]] < 8
        return fits

    def fill(self, digits: Bytes, lines: Rows, into: TextColumns) -> None:
        """Read the fields of all `lines` of this pattern into the columns."""
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
