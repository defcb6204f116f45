"""Find names, units and numbers of a CSV file from its first lines.

Known: any delimiter, a decimal comma, comments and metadata above the names, names in a comment,
units in brackets behind the names or in a row below them, no names at all, and MoTeC i2's export.
"""

import csv
import re
from collections import Counter
from dataclasses import dataclass

from slipbench.protocol.tables.table import split_unit
from slipbench.protocol.units import linear

LINES = 200  # looked at
_COMMENT = re.compile(r"^\s*(?:#|%|//)\s*")
_MOTEC = re.compile(r'\s*"?Format"?[,;]\s*"?MoTeC CSV File', re.IGNORECASE)
_UNIT_LIKE = re.compile(r"[^\s]{1,4}|[^\s]*[/^*%°µ·²³.][^\s]*|\w{1,12}")
_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?")
_DECIMAL_COMMA = re.compile(r"[+-]?\d*,\d+(?:[eE][+-]?\d+)?")
_MOMENT = re.compile(r"(?:\d{4}-\d{2}-\d{2}[T ])?\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d*)?)?(?:Z|[+-].*)?")
EMPTY = frozenset(
    ("", "-", "--", "nan", "NaN", "NAN", "null", "NULL", "None", "N/A", "n/a", "#N/A", "NA")
)


@dataclass(frozen=True)
class Layout:
    """How to read a file. `first_row`: index of the line in which the numbers begin."""

    delimiter: str
    decimal: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    first_row: int


def find_layout(lines: list[str]) -> Layout | None:
    """Work the layout out; None where no line holds numbers."""
    delimiter = _delimiter(lines)
    rows = [split(line, delimiter) for line in lines]
    first = _first_numbers(rows, lines)
    if first is None:
        return None
    width = max(len(row) for row in rows[first:])
    above = _titles(lines[:first], delimiter, width)
    titles, units = _names_and_units(above, width, motec=bool(_MOTEC.match(lines[0])))
    decimal = "," if delimiter != "," and _has_decimal_comma(rows[first:]) else "."
    return Layout(delimiter, decimal, unique_names(titles), units, first)


def split(line: str, delimiter: str) -> list[str]:
    """Split one line into its cells, quotes off."""
    if delimiter == " ":
        return line.split()
    cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    return [cell.strip() for cell in cells]


def is_number(cell: str) -> bool:
    """Tell whether a cell holds a number or a moment."""
    return bool(_NUMBER.fullmatch(cell) or _MOMENT.fullmatch(cell))


def _delimiter(lines: list[str]) -> str:
    """Choose the first delimiter by which the rows of numbers fall into equally many cells."""
    for delimiter in "\t;,| ":
        rows = [split(line, delimiter) for line in lines if not _COMMENT.match(line)]
        counts = Counter(len(row) for row in rows if row and is_number(row[0]))
        width, alike = counts.most_common(1)[0] if counts else (0, 0)
        if width > 1 and alike >= 0.9 * counts.total():
            return delimiter
    return ","


def _first_numbers(rows: list[list[str]], lines: list[str]) -> int | None:
    """Find the first row of numbers; most rows after it must be rows of numbers as well."""
    widths = Counter(len(row) for row in rows if _holds_numbers(row))
    width = widths.most_common(1)[0][0] if widths else 0
    good = [
        len(row) == width and _holds_numbers(row) and not _COMMENT.match(line)
        for row, line in zip(rows, lines, strict=True)
    ]
    if not any(good):
        return None
    first = good.index(True)
    filled = sum(bool(line.strip()) for line in lines[first:])
    return first if sum(good) >= 0.5 * filled else None


def _holds_numbers(row: list[str]) -> bool:
    filled = [cell for cell in row if cell not in EMPTY]
    numbers = sum(map(is_number, filled))
    return bool(filled) and numbers >= 0.5 * len(filled) and is_number(filled[0])


def _titles(lines: list[str], delimiter: str, width: int) -> list[list[str]]:
    """Give the last rows above the numbers that have as many cells as the numbers."""
    rows = [
        split(_COMMENT.sub("", line, count=1), delimiter) for line in lines if line.strip(",; ")
    ]
    found: list[list[str]] = []
    for row in reversed(rows):
        if not width - 1 <= len(row) <= width + 1 or len(found) == 2:
            break
        found.insert(0, (row + [""] * width)[:width])
    return found


def _names_and_units(
    above: list[list[str]], width: int, *, motec: bool
) -> tuple[list[str], tuple[str, ...]]:
    if not above:
        return [f"column {number}" for number in range(1, width + 1)], ("",) * width
    if len(above) == 2 and (motec or _are_units(above[1])):
        return above[0], tuple(cell.strip("()[]") for cell in above[1])
    pairs = [split_unit(title) for title in above[-1]]
    return [name for name, _ in pairs], tuple(unit for _, unit in pairs)


def _are_units(row: list[str]) -> bool:
    """Whether a row holds units: most cells are known units, and the others look like units.

    A logger has units of its own, such as MoTeC's LA for lambda; no name of a column is that short.
    """
    filled = [cell.strip("()[]") for cell in row if cell]
    known = sum(map(_is_unit, filled))
    return 2 * known >= len(filled) and all(_UNIT_LIKE.fullmatch(cell) for cell in filled)


def _is_unit(cell: str) -> bool:
    try:
        linear(cell.strip("()[]"), cell.strip("()[]"))
    except ValueError:
        return False
    return True


def _has_decimal_comma(rows: list[list[str]]) -> bool:
    return any(_DECIMAL_COMMA.fullmatch(cell) for row in rows for cell in row)


def unique_names(names: list[str]) -> tuple[str, ...]:
    """Number the columns that share a name; "" is left for the empty last column."""
    count: Counter[str] = Counter()
    unique = []
    for name in names:
        count[name] += 1
        unique.append(f"{name} #{count[name]}" if count[name] > 1 else name)
    return tuple(unique)
