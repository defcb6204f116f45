"""Read VBO files, the text format of RaceLogic's VBOX loggers.

Sections in square brackets. [header] has one line a column, with the unit behind some names;
[column names] has the same columns as short names; [channel units] has a line for each of the input
modules' columns, which are the last ones; it is empty for a column without a unit. Times of day are
hhmmss.ss in UTC. Latitude and longitude are in minutes, and longitude is positive to the west; here
both are in degrees, east positive.
Source: the description of the format in RaceLogic's VBOX manuals.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.csv_file import LARGEST, table_of_rows
from slipbench.protocol.tables.csv_layout import Layout, unique_names
from slipbench.protocol.tables.csv_text import Text, decode_text
from slipbench.protocol.tables.number_cells import decimal_of
from slipbench.protocol.tables.table import Table
from slipbench.protocol.tables.times import past_midnight
from slipbench.protocol.tables.titles import unit_in_name
from slipbench.protocol.user_file import read_user_file

FloatArray = npt.NDArray[np.float64]

_SECTION = re.compile(r"\s*\[\s*([^\]]+?)\s*\]\s*")
# Units that the format fixes, by names in [column names]. Speeds have theirs in [header] alone.
_OWN_UNITS: Mapping[str, str] = {"heading": "deg", "height": "m", "tsample": "s"}
_SPEEDS: Mapping[str, str] = {
    "velocity": "velocity",
    "vert-vel": "vertical velocity",
    "vertvel": "vertical velocity",
}
# Columns of the receiver, which have no line in [channel units], by [header] or [column names].
_STANDARD = re.compile(
    r"sat(?:s|ellites)$|time$|lat(?:itude)?$|long?(?:itude)?$|lng$|velocity|heading$|height$|vert[- ]?vel"
    r"|vertical_velocity|(?:trigger_)?event|tsample$|sampleperiod$|solution_type$|avi",
    re.IGNORECASE,
)
_POSITION = {"lat": "latitude", "latitude": "latitude", "long": "longitude", "lng": "longitude"}
_LIMITS = {"latitude": 90.0, "longitude": 180.0}


@dataclass(frozen=True)
class _Section:
    """Lines of a section that are not empty, each with its index in the file, and all lines."""

    first: int
    lines: tuple[tuple[int, str], ...]
    every: tuple[str, ...] = ()

    @property
    def texts(self) -> list[str]:
        """Lines without their blanks."""
        return [line.strip() for _, line in self.lines]


_NO_LINES = _Section(0, ())


def read_vbo(path: Path) -> Table:
    """Table of a VBO file: times in s of the day, positions in degrees.

    Raises InputError where a section is missing, and with line and column where a cell is no number.
    """
    text = decode_text(read_user_file(path, LARGEST))
    sections = _sections(text.lines)
    layout = _layout(sections, str(path))
    end = sections["data"].lines[-1][0] + 1
    rows = table_of_rows(str(path), replace(text, lines=text.lines[:end]), layout)
    doubts = []
    if sections.get("channel units", _NO_LINES).texts and not _stated_units(sections, layout.names):
        doubts = [f"{path}: the lines of [channel units] fit no columns, and are omitted"]
    return _converted(replace(rows, warnings=(*rows.warnings, *doubts)), layout, text)


def _sections(lines: Sequence[str]) -> dict[str, _Section]:
    found: dict[str, _Section] = {}
    name, first = "", 0
    kept: list[tuple[int, str]] = []
    for index, line in enumerate([*lines, "[end]"]):
        if match := _SECTION.fullmatch(line):
            every = tuple(text.strip() for text in lines[first:index])
            found.setdefault(name, _Section(first, tuple(kept), every))
            name, first, kept = match[1].casefold(), index + 1, []
        elif line.strip():
            kept.append((index, line))
    return found


def _layout(sections: Mapping[str, _Section], where: str) -> Layout:
    names = _column_names(sections, where)
    data = sections.get("data", _NO_LINES)
    if not data.lines:
        raise InputError(
            "no data in this VBO file",
            where=where,
            expected="rows of numbers below [data]",
            found=", ".join(f"[{name}]" for name in sections if name),
            remedy="was the recording ever started and closed?",
        )
    decimal, _ = decimal_of([line.split() for line in data.texts[:200]])
    units = _units(names, sections)
    return Layout(" ", decimal, unique_names(names), units, None, None, data.first)


def _column_names(sections: Mapping[str, _Section], where: str) -> list[str]:
    for section in ("column names", "columnnames"):
        if section in sections and sections[section].lines:
            return sections[section].texts[0].split()
    if "header" in sections and sections["header"].lines:
        return [line.replace(" ", "_") for line in sections["header"].texts]
    raise InputError(
        "a VBO file without names of columns",
        where=where,
        expected="a section [column names] or [header]",
        found=", ".join(f"[{name}]" for name in sections if name) or "no section",
        remedy="take another copy of the file",
    )


def _units(names: Sequence[str], sections: Mapping[str, _Section]) -> tuple[str, ...]:
    """Unit of each column: of [channel units] for the last ones, else of [header], else its own."""
    header = sections["header"].texts if "header" in sections else []
    titles = header if len(header) == len(names) else [_title(name, header) for name in names]
    own = [
        _header_unit(title) or _OWN_UNITS.get(name.casefold(), "")
        for title, name in zip(titles, names, strict=True)
    ]
    behind = _stated_units(sections, names)
    return (*own[: len(own) - len(behind)], *behind)


def _stated_units(sections: Mapping[str, _Section], names: Sequence[str]) -> list[str]:
    """Units of the last columns; an empty line is a column without a unit, or stands before a section.

    The number of columns that are not the receiver's own decides which of both it is; where empty lines
    fit no such number, the units cannot be assigned.
    """
    section = sections.get("channel units", _NO_LINES)
    others = sum(not _STANDARD.match(name) for name in names)
    lines = list(section.every)
    without_end = lines[:-1] if lines and not lines[-1] else lines
    chosen = next((found for found in (without_end, lines) if len(found) == others), section.texts)
    gaps = "" in "\n".join(lines).rstrip("\n").split("\n")
    if len(chosen) > len(names) or (len(chosen) != others and gaps):
        return []
    return ["" if unit == "(null)" else unit for unit in chosen]


def _title(name: str, header: Sequence[str]) -> str:
    """Title in [header] of a speed; "" for other columns, which have fixed units or none."""
    start = _SPEEDS.get(name.casefold())
    return next((t for t in header if start and t.casefold().startswith(start)), "")


def _header_unit(title: str) -> str:
    """Unit at the end of a title such as "velocity kmh" or "vertical velocity m/s"."""
    last = title.rpartition(" ")[2]
    return last if "/" in last else unit_in_name(title)


def _converted(table: Table, layout: Layout, text: Text) -> Table:
    """Times and positions in s and degrees."""
    pa = optional_library("pyarrow")

    data, units = table.data, dict(table.units)
    warnings = list(table.warnings)
    names = []
    for number, name in enumerate(table.names):
        plain = name.casefold()
        column = None
        if plain == "time":
            column = _times(table, name)
            units[name] = "s"
        elif plain in _POSITION:
            column = _degrees(table, name, _POSITION[plain], warnings)
            units.pop(name, None)
            units[_POSITION[plain]] = "deg"
        if column is not None:
            data = data.set_column(number, name, pa.array(column, from_pandas=True))
        names.append(_POSITION.get(plain, name))
    shown = (
        f"VBO, {text.encoding}, numbers from line {layout.first_row + 1}",
        "time in s of the day (UTC); latitude and longitude from minutes in degrees, east positive",
    )
    return replace(
        table,
        data=data.rename_columns(list(unique_names(names))),
        units={name: unit for name, unit in units.items() if unit},
        warnings=tuple(warnings),
        layout=shown,
    )


def _numbers(table: Table, name: str) -> FloatArray:
    """Values of a column, (n,). Raises InputError, with line and column, for a cell of text."""
    pa = optional_library("pyarrow")

    cells = table.data[name].combine_chunks()
    if not pa.types.is_string(cells.type):
        return np.asarray(cells.cast(pa.float64()).to_numpy(zero_copy_only=False), np.float64)
    for row, cell in enumerate(cells.to_pylist()):
        if cell is not None and not re.fullmatch(r"[+-]?\d*[.,]?\d+([eE][+-]?\d+)?", cell):
            raise _bad_cell(table, name, row, "a number", repr(cell))
    raise _bad_cell(table, name, 0, "numbers", str(cells[0]))


def _times(table: Table, name: str) -> FloatArray:
    """Times in s since midnight of numbers such as 102856.20, which is 10:28:56.2."""
    packed = _numbers(table, name)
    # To 10 us, before it is divided: 102860 of 102859.9999 would be a minute with 60 s.
    ticks = np.round(np.nan_to_num(packed) * 1e5)
    hours, minutes = np.floor(ticks / 1e9), np.floor(ticks / 1e7) % 100
    seconds = ticks % 1e7 / 1e5
    odd = np.flatnonzero((hours > 24) | (minutes >= 60) | (seconds >= 61) | (packed < 0))
    if odd.size:
        raise _bad_cell(
            table, name, int(odd[0]), "a time of day, hhmmss.ss", f"{packed[odd[0]]:.3f}"
        )
    time = hours * 3600 + minutes * 60 + seconds
    return past_midnight(np.where(np.isnan(packed), np.nan, time))


def _degrees(table: Table, name: str, what: str, warnings: list[str]) -> FloatArray:
    degrees = _numbers(table, name) / (60.0 if what == "latitude" else -60.0)
    outside = np.abs(degrees) > _LIMITS[what]
    if outside.any():
        first = table.at_row(int(np.flatnonzero(outside)[0]))
        warnings.append(f"{first}: {int(outside.sum())} values are no {what} and are omitted")
    return np.where(outside, np.nan, degrees)


def _bad_cell(table: Table, name: str, row: int, expected: str, found: Any) -> InputError:
    return InputError(
        f"column {name!r} cannot be read",
        where=f"{table.at_row(row)}, column {table.names.index(name) + 1}",
        expected=expected,
        found=found,
        remedy="correct or delete that row in a copy",
    )
