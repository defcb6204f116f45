"""GVRET CSV, SavvyCAN's own format: one frame in each line, times in whole microseconds.

    Time Stamp,ID,Extended,Bus,LEN,D1,D2,D3,D4,D5,D6,D7,D8
    166064000,0000021A,false,0,8,FE,36,12,FE,69,05,07,AD,

Newer versions of SavvyCAN have the column Dir (Rx or Tx) before Bus. Identifiers and data are
hexadecimal. More than 8 data bytes make a CAN FD frame. (SavvyCAN, framefileio.cpp,
saveNativeCSVFile and loadNativeCSVFile.)
"""

import re
from collections.abc import Iterator
from pathlib import Path

from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.candump import candump_pieces
from slipbench.protocol.logs.candump_line import IDENTIFIER_MASK, LATEST_SECOND, format_line
from slipbench.protocol.logs.reading import Progress

EXPECTED = '"microseconds,identifier,extended,bus,length,data", as in "1000,123,false,0,2,DE,AD,"'
_LINE = re.compile(
    rb"\s*(?P<time>\d{1,19})\s*,\s*(?:0x)?(?P<identifier>[0-9a-f]{1,8})\s*,"
    rb"\s*(?P<extended>true|false|[01])\s*,(?:\s*(?P<direction>[rt]x)\s*,)?"
    rb"\s*(?P<bus>\d{1,3})\s*,\s*(?P<length>\d{1,2})\s*(?P<data>(?:,\s*[0-9a-f]{0,2}\s*)*)",
    re.IGNORECASE,
)
_HEADING = re.compile(rb"(?:\xef\xbb\xbf)?\s*time ?stamp,", re.IGNORECASE)
_US = 1_000_000  # in a second
_FD_LENGTHS = frozenset((12, 16, 20, 24, 32, 48, 64))


def gvret_pieces(path: Path, warnings: list[str], progress: Progress) -> Iterator[bytes]:
    """Frames of the GVRET file `path` as pieces of candump text, in the order of the file.

    An incomplete last line is omitted with a warning. Raises InputError for any other line
    that is no frame.
    """
    number = 0
    for piece in candump_pieces(path, progress, expected=EXPECTED):
        complete, found = piece.endswith(b"\n"), []
        lines = piece.removesuffix(b"\n").split(b"\n")
        for line in lines:
            number += 1
            frame = _frame(line)
            if frame is None and not complete and line is lines[-1] and number > 1:
                text = line[:80].decode("ascii", errors="backslashreplace")
                warnings.append(f"{path}: the last line is incomplete and omitted: {text!r}")
            elif frame is None:
                raise _no_frame(path, number, line)
            else:
                found.append(frame)
        yield b"".join(found)


def _frame(line: bytes) -> bytes | None:
    """One line as candump text; empty for a heading or a blank line, None for anything else."""
    match = _LINE.fullmatch(line)
    if match is None:
        return b"" if not line.strip() or _HEADING.match(line) else None
    time, identifier = int(match["time"]), int(match["identifier"], 16)
    extended = match["extended"].lower() in (b"true", b"1")
    length = int(match["length"])
    cells = [cell.strip() for cell in match["data"].split(b",")[1 : length + 1]]
    if time > LATEST_SECOND * _US or identifier > (IDENTIFIER_MASK if extended else 0x7FF):
        return None
    if len(cells) < length or not all(cells) or (length > 8 and length not in _FD_LENGTHS):
        return None
    return format_line(
        time * 1000,
        f"can{int(match['bus'])}",
        identifier,
        bytes(int(cell, 16) for cell in cells),
        extended=extended,
        fd_flags=0 if length > 8 else None,
        sent=(match["direction"] or b"").lower() == b"tx",
    )


def _no_frame(path: Path, number: int, line: bytes) -> InputError:
    return InputError(
        "this line is not a frame of GVRET CSV",
        where=f"{path}: line {number}",
        expected=EXPECTED,
        found=repr(line[:80].decode("ascii", errors="backslashreplace")),
        remedy="correct or delete that line in a copy of the log",
    )
