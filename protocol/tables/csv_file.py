"""Read a CSV file into a Table, the numbers by pyarrow, all at once."""

import csv
from pathlib import Path
from typing import Any

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.csv_layout import EMPTY, LINES, Layout, find_layout, split
from slipbench.protocol.tables.table import Table
from slipbench.protocol.user_file import read_user_file

LARGEST = 1 << 28  # bytes; the text, its lines and the numbers take some eight times as much memory


def read_csv(path: Path) -> Table:
    """Table of a CSV file. Raises InputError where the file holds none."""
    try:
        return _read(path, _lines(path))
    except csv.Error as cause:  # a cell of more than 128 KiB
        raise InputError(
            "this file is not a table",
            where=str(path),
            expected="rows of numbers",
            found=str(cause),
            remedy="check that it is the right file; is a quotation mark missing in it?",
        ) from cause


def _read(path: Path, lines: list[str]) -> Table:
    layout = find_layout(lines[:LINES])
    if layout is None:
        raise InputError(
            "no rows of numbers in this file",
            where=str(path),
            expected="a table: names, perhaps units, then rows of numbers",
            found=repr(next((line for line in lines if line.strip()), "")[:80]),
            remedy="export it as CSV with one row for each sample",
        )
    warnings: list[str] = []
    rows = _rows(lines, layout, str(path), warnings)
    data = _parse("\n".join(rows), layout, str(path))
    keep = [name for name in data.column_names if not _is_nothing(name, data[name])]
    units = {name: unit for name, unit in zip(layout.names, layout.units, strict=True) if unit}
    return Table(str(path), data.select(keep), units, {}, tuple(warnings))


def _lines(path: Path) -> list[str]:
    content = read_user_file(path, LARGEST)
    if content.startswith((b"\xff\xfe", b"\xfe\xff")):
        return content.decode("utf-16", errors="replace").splitlines()
    try:
        return content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace").splitlines()


def _rows(lines: list[str], layout: Layout, where: str, warnings: list[str]) -> list[str]:
    """Rows of numbers. An incomplete last row gives a warning; any other raises InputError."""
    width = len(layout.names)
    numbered = [
        (number, line)
        for number, line in enumerate(lines[layout.first_row :], layout.first_row + 1)
        if line.strip() and not line.lstrip().startswith(("#", "%", "//"))
    ]
    if layout.delimiter == " ":
        numbered = [(number, " ".join(line.split())) for number, line in numbered]
    for number, line in numbered:
        if line.count(layout.delimiter) + 1 == width:
            continue
        cells = len(split(line, layout.delimiter))
        if cells < width and number == numbered[-1][0]:
            warnings.append(f"{where}: the last row is incomplete and omitted: {line[:60]!r}")
            return [line for _, line in numbered[:-1]]
        if cells != width:
            raise _odd_row(where, number, line, cells, layout)
    return [line for _, line in numbered]


def _odd_row(where: str, number: int, line: str, cells: int, layout: Layout) -> InputError:
    return InputError(
        "this row does not fit the table",
        where=f"{where}: line {number}",
        expected=f"{len(layout.names)} cells between {layout.delimiter!r}",
        found=f"{cells} cells: {line[:60]!r}",
        remedy="correct or delete that row in a copy",
    )


def _parse(text: str, layout: Layout, where: str) -> Any:
    pa = optional_library("pyarrow")
    arrow_csv = optional_library("pyarrow.csv")

    try:
        return arrow_csv.read_csv(
            pa.py_buffer(text.encode("utf-8")),
            arrow_csv.ReadOptions(column_names=list(layout.names)),
            arrow_csv.ParseOptions(delimiter=layout.delimiter),
            arrow_csv.ConvertOptions(
                null_values=sorted(EMPTY), strings_can_be_null=True, decimal_point=layout.decimal
            ),
        )
    except pa.ArrowInvalid as cause:
        raise InputError(
            "not a table that can be read",
            where=where,
            found=str(cause)[:200],
            remedy="correct that row in a copy, or export the table again",
        ) from cause


def _is_nothing(name: str, column: Any) -> bool:
    """Tell the empty column that a delimiter at the end of each line makes."""
    return not name.split(" #")[0] and column.null_count == len(column)
