"""Read a CSV file into a Table, the numbers by pyarrow, all at once."""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.csv_layout import LINES, Layout, find_layout, split
from slipbench.protocol.tables.csv_long import find_long
from slipbench.protocol.tables.csv_text import Text, decode_text
from slipbench.protocol.tables.long_table import by_channel, long_columns
from slipbench.protocol.tables.number_cells import EMPTY, decimal_of, numbers
from slipbench.protocol.tables.table import Table
from slipbench.protocol.tables.times import is_time_name
from slipbench.protocol.tables.titles import unit_in_name
from slipbench.protocol.user_file import read_user_file

LARGEST = 1 << 28  # bytes; the text, its lines and the numbers take some eight times as much memory
_COMMA = re.compile(r"\d,\d")
_QUOTED_COMMA = re.compile(r'"[^",]*\d,\d[^",]*"')
_DELIMITERS = {"\t": "tab", " ": "blanks", ";": "semicolon", ",": "comma", "|": "bar"}


def read_csv(path: Path) -> Table:
    """Table of a CSV file. Raises InputError where the file holds none."""
    text = decode_text(read_user_file(path, LARGEST))
    try:
        return _read(str(path), text)
    except csv.Error as cause:  # a cell of more than 128 KiB
        raise InputError(
            "this file is not a table",
            where=str(path),
            expected="rows of numbers",
            found=str(cause),
            remedy="check that it is the right file; is a quotation mark missing in it?",
        ) from cause


def holds_table(head: bytes) -> bool:
    """Whether the first bytes of a file, which may break off anywhere, are those of a CSV file."""
    lines = decode_text(head).lines[:LINES]
    try:
        layout = find_long(lines) or find_layout(lines)
    except csv.Error:
        return False
    return layout is not None and len(layout.names) > 1


def _read(where: str, text: Text) -> Table:
    head = text.lines[:LINES]
    layout = find_long(head) or find_layout(head)
    if layout is None:
        raise InputError(
            "no rows of numbers in this file",
            where=where,
            expected="a table: names, perhaps units, then rows of numbers",
            found=repr(next((line for line in text.lines if line.strip()), "")[:80]),
            remedy="export it as CSV with one row for each sample",
        )
    table = table_of_rows(where, text, layout)
    long = long_columns(layout.names)
    return by_channel(table, long) if long else table


def table_of_rows(where: str, text: Text, layout: Layout) -> Table:
    """Table of a text whose layout is known. Raises InputError with the line of a wrong row."""
    warnings: list[str] = []
    lines, rows = _rows(text.lines, layout, where, warnings)
    layout = _with_decimal(layout, rows)
    warnings[:0] = _doubts(where, text, layout)
    data = _with_numbers(_parse(rows, lines, layout, where), layout, where, warnings)
    keep = [name for name in data.column_names if not _is_nothing(name, data[name])]
    units, guessed = _units(layout)
    clocks = _clocks(keep)
    shown = [*_description(layout, text), *guessed]
    if clocks:
        shown.append(f"{len(set(clocks.values()))} time columns, each for the columns behind it")
    return Table(
        where,
        data.select(keep),
        units,
        clocks,
        tuple(warnings),
        tuple(shown),
        _breaks(lines),
        layout.decimal,
    )


def _clocks(names: Sequence[str]) -> dict[str, str]:
    """Time column of each column where several of one name stand among the others.

    So CANape and others export signals of different rates: Time, a, Time, b.
    """
    times = [name for name in names if is_time_name(name)]
    same = Counter(name.split(" #")[0] for name in times)
    clocks: dict[str, str] = {}
    clock = ""
    for name in names:
        if name in times and same[name.split(" #")[0]] > 1:
            clock = name
        elif clock:
            clocks[name] = clock
    return clocks


def _with_decimal(layout: Layout, rows: list[str]) -> Layout:
    """Layout with the decimal mark of all rows, of which the first ones may have whole numbers only."""
    pattern = _QUOTED_COMMA if layout.delimiter == "," else _COMMA
    first, odd = rows[:LINES], [row for row in rows[LINES:] if pattern.search(row)]
    if not odd and not any(map(pattern.search, first)):  # the layout is known from fewer rows
        return layout
    decimal, doubtful = decimal_of(split(row, layout.delimiter) for row in (*first, *odd))
    return replace(layout, decimal=decimal, doubtful_comma=doubtful)


def _with_numbers(data: Any, layout: Layout, where: str, warnings: list[str]) -> Any:
    """Columns of text as numbers, where every cell is a number or states that there is none."""
    pa = optional_library("pyarrow")

    if long_columns(layout.names):
        return data  # its numbers are those of one channel each
    for place, name in enumerate(data.column_names):
        if not pa.types.is_string(data[name].type):
            continue
        texts = data[name].to_pylist()
        found = numbers(texts, layout.decimal)
        if isinstance(found, int) or not np.isfinite(found).any():
            continue
        data = data.set_column(place, name, pa.array(found, from_pandas=True))
        none = [texts[row] for row in np.flatnonzero(np.isnan(found)) if (texts[row] or "").strip()]
        if none:
            warnings.append(
                f"{where}: {name}: cells without a number count as empty: {len(none)},"
                f" the first {none[0]!r}"
            )
    return data


def _doubts(where: str, text: Text, layout: Layout) -> list[str]:
    warnings = []
    if text.undecoded:
        warnings.append(f"{where}: {text.undecoded} characters are not {text.encoding}")
    if layout.doubtful_comma:
        warnings.append(
            f"{where}: commas in numbers are read as decimal commas; if they divide thousands,"
            " export the table without them"
        )
    return warnings


def _units(layout: Layout) -> tuple[dict[str, str], list[str]]:
    """Units by column, and what is shown of those that only the end of a name states."""
    units = {name: unit for name, unit in zip(layout.names, layout.units, strict=True) if unit}
    guessed = {
        name: unit_in_name(name)
        for name in layout.names
        if name not in units and unit_in_name(name)
    }
    listed = ", ".join(f"{name} [{unit}]" for name, unit in guessed.items())
    return units | guessed, [f"units taken from names: {listed}"] if listed else []


def _description(layout: Layout, text: Text) -> list[str]:
    logger = f" of {layout.logger}" if layout.logger else ""
    comma = ", decimal comma" if layout.decimal == "," else ""
    names = f"names in line {layout.names_row + 1}" if layout.names_row is not None else "no names"
    units = "units in the names" if any(layout.units) else "no units stated"
    if layout.units_row is not None:
        units = f"units in line {layout.units_row + 1}"
    return [
        f"CSV{logger}, {text.encoding}, delimiter {_DELIMITERS[layout.delimiter]}{comma};"
        f" {names}, {units}, numbers from line {layout.first_row + 1}"
    ]


def _rows(
    lines: list[str], layout: Layout, where: str, warnings: list[str]
) -> tuple[list[int], list[str]]:
    """Line numbers and rows. An incomplete last row gives a warning; any other raises InputError."""
    width = len(layout.names)
    numbered = [
        (number, line)
        for number, line in enumerate(lines[layout.first_row :], layout.first_row + 1)
        if line.strip() and not line.lstrip().startswith(("#", "%", "//"))
    ]
    if layout.delimiter == " ":
        numbered = [(number, " ".join(line.split())) for number, line in numbered]
    for number, line in numbered:
        if '"' not in line and line.count(layout.delimiter) + 1 == width:
            continue
        cells = len(split(line, layout.delimiter))
        if cells < width and number == numbered[-1][0]:
            warnings.append(f"{where}: the last row is incomplete and omitted: {line[:60]!r}")
            numbered.pop()
        elif cells != width:
            raise _odd_row(where, number, line, cells, layout)
    return [number for number, _ in numbered], [line for _, line in numbered]


def _breaks(numbers: Sequence[int]) -> tuple[tuple[int, int], ...]:
    """(row, line) wherever lines were skipped before a row."""
    lines = np.asarray(numbers, np.int64)
    at = np.flatnonzero(np.diff(lines, prepend=-1) != 1)
    return tuple((int(row), int(lines[row])) for row in at)


def _odd_row(where: str, number: int, line: str, cells: int, layout: Layout) -> InputError:
    missing = layout.names[cells] if cells < len(layout.names) else ""
    return InputError(
        "this row does not fit the table",
        where=f"{where}: line {number}",
        expected=f"{len(layout.names)} cells between {layout.delimiter!r}",
        found=f"{cells} cells: {line[:60]!r}" + (f"; none for {missing!r}" if missing else ""),
        remedy="correct or delete that row in a copy",
    )


def _parse(rows: list[str], numbers: list[int], layout: Layout, where: str) -> Any:
    pa = optional_library("pyarrow")
    arrow_csv = optional_library("pyarrow.csv")

    try:
        return arrow_csv.read_csv(
            pa.py_buffer("\n".join(rows).encode("utf-8")),
            arrow_csv.ReadOptions(column_names=list(layout.names)),
            arrow_csv.ParseOptions(delimiter=layout.delimiter),
            arrow_csv.ConvertOptions(
                null_values=sorted(EMPTY), strings_can_be_null=True, decimal_point=layout.decimal
            ),
        )
    except pa.ArrowInvalid as cause:
        row = re.search(r"Row #(\d+)", str(cause))
        raise InputError(
            "not a table that can be read",
            where=f"{where}: line {numbers[int(row[1]) - 1]}" if row else where,
            found=str(cause)[:200],
            remedy="correct that row in a copy, or export the table again",
        ) from cause


def _is_nothing(name: str, column: Any) -> bool:
    """Whether a column is the empty one that a delimiter at the end of each line makes."""
    return not name.split(" #")[0] and column.null_count == len(column)
