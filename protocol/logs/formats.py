"""Recognize the format of a log by its content; the ending of its name decides ties only."""

import re
from dataclasses import dataclass
from pathlib import Path

from slipbench.protocol.errors import InputError
from slipbench.protocol.user_file import open_user_file

HEAD = 4096  # bytes looked at

_CONVERT = "save it as candump text, PCAN .trc, Vector .asc or .blf, or ASAM .mf4"
_TABLE = "export it as CSV or Parquet"


@dataclass(frozen=True)
class Format:
    """One file format. refused: what to do instead, for a format that is not read."""

    title: str
    reader: str  # "candump", "python-can", "asammdf", "table" or ""
    head: re.Pattern[bytes]
    refused: str = ""


def _starts(pattern: bytes) -> re.Pattern[bytes]:
    return re.compile(rb"(?:\xef\xbb\xbf)?\s*" + pattern, re.IGNORECASE)


FORMATS = {
    "mf4": Format("ASAM MDF", "asammdf", _starts(rb"(?:MDF     |UnFinMF )")),
    "blf": Format("Vector BLF", "python-can", re.compile(rb"LOGG(?![A-Za-z,;])")),
    "candump": Format("candump text", "candump", _starts(rb"\(\d+\.\d+\)\s+\S+\s+[0-9a-f]+#")),
    "candump-screen": Format(
        "candump's screen output",
        "",
        _starts(rb"(?:\(\d+\.\d+\)\s+)?\S+\s+(?:[TR]X\s+\S+\s+)?[0-9a-f]{3,8}\s+\[\d+\]"),
        'record with "candump -L" (or -l), which keeps exact times',
    ),
    "asc": Format(
        "Vector ASC",
        "python-can",
        _starts(
            rb"(?:date\s+\w{2,4}\s|base\s+(?:hex|dec)|Begin Triggerblock|// version \d"
            rb"|\d+\.\d+\s+(?:\d+|CANFD)\s+.*\b[RT]x\b)"
        ),
    ),
    "trc": Format(
        "PCAN trace",
        "python-can",
        _starts(rb"(?:;\$FILEVERSION|;[^\n]*(?:PCAN|Start time|###)|\d+\)\s+\d+\.?\d*\s)"),
    ),
    "can-csv": Format("python-can CSV", "python-can", _starts(rb"timestamp,arbitration_id,")),
    "busmaster": Format(
        "a BUSMASTER log",
        "",
        _starts(rb"(?:\*\*\*BUSMASTER|\d+:\d+:\d+:\d+\s+[RT]x\s)"),
        f"open it in SavvyCAN and {_CONVERT}",
    ),
    "crtd": Format(
        "a CRTD log (Open Vehicle Monitoring System)",
        "",
        _starts(rb"\d+\.\d+\s+\d*(?:C[A-Z]{2}|[RT](?:11|29))\s"),
        f"open it in SavvyCAN and {_CONVERT}",
    ),
    "gvret": Format(
        "GVRET CSV (SavvyCAN)",
        "gvret",
        _starts(rb"(?:Time Stamp,ID,Extended|\d+,[0-9a-f]{8},(?:true|false),)"),
    ),
    "carbus": Format(
        "a CAR BUS Analyzer trace", "", _starts(rb"@ TEXT @"), f"open it in SavvyCAN and {_CONVERT}"
    ),
    "motec-ld": Format(
        "a MoTeC binary log (.ld)",
        "",
        re.compile(rb"\x40\x00\x00\x00\x00\x00\x00\x00"),
        "export it from MoTeC i2 as CSV and give that",
    ),
    "xrk": Format("AiM XRK", "table", re.compile(rb"<h[A-Za-z]{3}[A-Za-z \x00]")),
    "xrz": Format(
        "AiM XRZ", "table", re.compile(rb"\x78[\x01\x5e\x9c\xda][^\x09\x0a\x0d\x20-\x7e]")
    ),
    "compressed": Format(
        "a compressed file",
        "",
        re.compile(rb"(?:\x1f\x8b|PK\x03\x04|BZh|\xfd7zXZ|\x28\xb5\x2f\xfd)"),
        "unpack it first",
    ),
    "spreadsheet": Format(
        "an old spreadsheet", "", re.compile(rb"\xd0\xcf\x11\xe0"), "save it as CSV"
    ),
    "sqlite": Format("ROS 2 bag (SQLite)", "table", re.compile(rb"SQLite format 3")),
    "ros1-bag": Format("ROS 1 bag", "table", re.compile(rb"#ROSBAG V2\.0")),
    "mcap": Format("MCAP", "table", re.compile(rb"\x89MCAP")),
    "matlab": Format("a MATLAB file", "", re.compile(rb"MATLAB 5\.0"), _TABLE),
    "hdf5": Format("an HDF5 file", "", re.compile(rb"\x89HDF"), _TABLE),
    "parquet": Format("Parquet", "table", re.compile(rb"PAR1")),
    "vbo": Format(
        "RaceLogic VBO",
        "table",
        _starts(rb"(?:[^\[\n][^\n]*\n\s*){0,4}\[(?:header|column names|comments)\]\s"),
    ),
    "gpx": Format(
        "GPX",
        "table",
        re.compile(
            rb"(?:\xef\xbb\xbf)?\s*(?:<\?xml.{0,200}?\?>\s*)?(?:<!--.{0,2000}?-->\s*)*<gpx[\s>]",
            re.DOTALL,
        ),
    ),
    "fit": Format("FIT", "table", re.compile(rb"[\x0c\x0e].{7}\.FIT", re.DOTALL)),
    "motec-csv": Format("MoTeC CSV", "table", _starts(rb'"?Format"?[,;]\s*"?MoTeC CSV File')),
}


def looks_like(head: bytes) -> str | None:
    """Format (a key of FORMATS) whose files begin like `head`; None where none is known."""
    return next((name for name, one in FORMATS.items() if one.head.match(head)), None)


def read_head(path: Path, most: int = HEAD) -> bytes:
    """First bytes of a file, at most `most`. Raises InputError for a missing or an empty file."""
    with open_user_file(path) as file:
        try:
            head = file.read(most)
        except OSError as cause:  # a damaged disk, files of /proc
            raise InputError("cannot be read", where=str(path), found=str(cause)) from cause
    if not head.strip(b"\0\r\n\t \xef\xbb\xbf"):
        what = "the file is empty" if not head else "the file holds nothing but blanks or NUL bytes"
        raise InputError(
            what,
            where=str(path),
            expected="a log of frames, or a table",
            found=f"{path.stat().st_size} bytes",
            remedy="was the recording ever started and closed?",
        )
    return head


def refusal(name: str, path: Path) -> InputError:
    """Error that names the format of a file and what to convert it to."""
    form = FORMATS[name]
    return InputError(
        f"this is {form.title}, which no library here reads", where=str(path), remedy=form.refused
    )
