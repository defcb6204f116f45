"""Read FIT files, the binary format of Garmin and other sport loggers. Decoded by fitdecode.

Every message with a time stamp and numbers is read; "record" holds position and speed. A file that is
damaged is read up to the damage, and a warning states it.
"""

import warnings as python_warnings
from collections import Counter
from collections.abc import Iterator
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.groups import Group, table_of_groups
from slipbench.protocol.tables.table import Table
from slipbench.protocol.user_file import read_user_file

LARGEST = 1 << 28  # bytes
SEMICIRCLE = 180.0 / 2**31  # deg
MAIN = "record"
# Units that the profile writes in its own way. A unit of counts is none.
UNITS = {"C": "degC", "bpm": "", "semicircles": "deg", "watts": "W", "%": "%"}
NAMES = {
    "position_lat": "latitude",
    "position_long": "longitude",
    "enhanced_altitude": "altitude",
    "enhanced_speed": "speed",
}
SKIPPED = ("timestamp", "timestamp_ms")

Row = tuple[float, dict[str, tuple[float, str]]]


def read_fit(path: Path) -> Table:
    """Table of the messages of a FIT file, each kind with its own times, in s since 1970.

    Raises InputError where no message with a time and a number can be read.
    """
    content = read_user_file(path, LARGEST)
    rows: dict[str, list[Row]] = {}
    undated: Counter[str] = Counter()
    warnings = []
    try:
        for message in _messages(content):
            row = _row(message)
            if row is None:
                undated[message.name] += 1
            elif row[1]:
                rows.setdefault(message.name, []).append(row)
    except Exception as cause:  # fitdecode passes on any exception of its parsing
        read = sum(map(len, rows.values()))
        damage = f"{type(cause).__name__}: {cause}"[:200]
        if not read:
            raise _unreadable(path, damage) from cause
        warnings.append(
            f"{path}: damaged or broken off: {damage}; {read} messages before it are read"
        )
    if not rows:
        listed = ", ".join(f"{count} {name}" for name, count in undated.items())
        raise _unreadable(path, listed or "no message")
    groups = [_group(name, found) for name, found in rows.items()]
    counts = ", ".join(f"{len(found)} {name}" for name, found in rows.items())
    return table_of_groups(
        str(path), groups, (f"FIT, messages: {counts}; times in UTC",), tuple(warnings)
    )


def _unreadable(path: Path, found: str) -> InputError:
    return InputError(
        "no time series in this FIT file",
        where=str(path),
        expected="messages with a time stamp and numbers, such as record",
        found=found,
        remedy="give the file of an activity, copied whole from the device",
    )


def _messages(content: bytes) -> Iterator[Any]:
    fitdecode = optional_library("fitdecode")

    with python_warnings.catch_warnings():
        python_warnings.simplefilter("ignore")
        check = fitdecode.CrcCheck.RAISE
        with fitdecode.FitReader(BytesIO(content), check_crc=check) as fit:
            for frame in fit:
                if frame.frame_type == fitdecode.FIT_FRAME_DATA:
                    yield frame


def _row(message: Any) -> Row | None:
    """Time (s since 1970) and numbers of a message, with their units; None without a time."""
    time: float | None = None
    milliseconds = 0.0
    values: dict[str, tuple[float, str]] = {}
    for field in message.fields:
        if field.name == "timestamp" and isinstance(field.value, datetime):
            moment = field.value if field.value.tzinfo else field.value.replace(tzinfo=UTC)
            time = moment.timestamp()
        elif field.name == "timestamp_ms" and _is_number(field.value):
            milliseconds = float(field.value)
        if field.name not in SKIPPED:
            values.update(_numbers(field))
    return None if time is None else (time + milliseconds * 1e-3, values)


def _numbers(field: Any) -> Iterator[tuple[str, tuple[float, str]]]:
    """Numbers of a field by name; the elements of an array are numbered from 0."""
    name, unit = NAMES.get(field.name, field.name), str(field.units or "")
    factor = SEMICIRCLE if unit == "semicircles" else 1.0
    unit = UNITS.get(unit, unit)
    if _is_number(field.value):
        yield name, (field.value * factor, unit)
    elif isinstance(field.value, (tuple, list)):
        for index, value in enumerate(field.value):
            if _is_number(value):
                yield f"{name}[{index}]", (value * factor, unit)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _group(message: str, rows: list[Row]) -> Group:
    """Channels of one kind of message; those of the main one have no prefix."""
    units = {name: unit for _, values in rows for name, (_, unit) in values.items()}
    prefix = "" if message == MAIN else f"{message}."
    channels = {
        prefix + name: (
            np.array([values[name][0] if name in values else np.nan for _, values in rows]),
            unit,
        )
        for name, unit in units.items()
    }
    return Group(np.array([time for time, _ in rows]), channels)
