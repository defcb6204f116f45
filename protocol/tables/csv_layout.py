"""Find names, units and numbers of a CSV file from its first lines.

Known: any delimiter, a decimal comma, comments and metadata above the names, names in a comment,
units in or behind the names or in a row below or above them, no names at all, the exports of MoTeC i2
and of AiM's RaceStudio, and RaceCapture's titles.
"""

import csv
import re
from collections import Counter
from dataclasses import dataclass

from slipbench.protocol.tables.dates import is_date
from slipbench.protocol.tables.number_cells import decimal_of, is_missing
from slipbench.protocol.tables.times import is_time_name
from slipbench.protocol.tables.titles import split_unit
from slipbench.protocol.units import is_unit

LINES = 200  # looked at
LIKE_UNITS = 0.8  # share of the cells of a row of units; RaceChrono has "unix time" among them
HEADER_ROWS = 3  # rows above the numbers that may hold names and units
_COMMENT = re.compile(r"^\s*(?:#|%|//)\s*")
_SECTION = re.compile(r"\s*\[[^\],;\t]+\]\s*")  # [Channel Data], as HP Tuners writes it
_LOGGER = re.compile(r'\s*"?Format"?[,;]\s*"?(MoTeC|AIM) CSV File', re.IGNORECASE)
_UNIT_LIKE = re.compile(r"[^\s]{1,4}|[^\s]*[/^*%°µ·²³.][^\s]*|\w{1,12}")
_NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?")
_MOMENT = re.compile(r"(?:[\w./-]{6,11}[T ])?\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d*)?)?(?:Z|[+-].*)?")
_TIME_UNITS = ("s", "sec", "ms", "us", "µs", "ns", "min", "hh:mm:ss")


@dataclass(frozen=True)
class Layout:
    """Layout of a file. Rows count from 0 in the lines of the file.

    names_row, units_row   None where the file has none, or where the units stand in the names
    first_row              in which the numbers begin
    doubtful_comma         every decimal comma may as well divide thousands: "1,234"
    logger                 "MoTeC" or "AIM" where the file states it
    """

    delimiter: str
    decimal: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    names_row: int | None
    units_row: int | None
    first_row: int
    doubtful_comma: bool = False
    logger: str = ""


@dataclass(frozen=True)
class _Row:
    """Cells of one line above the numbers, and its index in the file."""

    index: int
    cells: list[str]


def find_layout(lines: list[str]) -> Layout | None:
    """Layout of a file; None where no line holds numbers."""
    delimiter = _delimiter(lines)
    rows = [split(line, delimiter) for line in lines]
    first = _first_numbers(rows, lines)
    if first is None:
        return None
    width = max(len(row) for row in rows[first:])
    above = _titles(lines[:first], delimiter, width)
    logger = _LOGGER.match(lines[0])
    names, units = _names_and_units(above, motec=bool(logger))
    titles = names.cells if names else [f"column {number + 1}" for number in range(width)]
    pairs = [(title, "") for title in titles] if units else _split_units(titles)
    beside = [cell.strip("()[]") for cell in units.cells] if units else [unit for _, unit in pairs]
    decimal, doubtful = decimal_of(rows[first:])
    return Layout(
        delimiter,
        decimal,
        unique_names([name for name, _ in pairs]),
        tuple(beside),
        names.index if names else None,
        units.index if units else None,
        first,
        doubtful,
        logger[1] if logger else "",
    )


def split(line: str, delimiter: str) -> list[str]:
    """Cells of one line, without quotes."""
    if delimiter == " ":
        return line.split()
    cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    return [cell.strip() for cell in cells]


def is_number(cell: str) -> bool:
    """Whether a cell holds a number, a date or a time."""
    return bool(_NUMBER.fullmatch(cell) or _MOMENT.fullmatch(cell) or is_date(cell))


def _delimiter(lines: list[str]) -> str:
    """First delimiter that divides all rows of numbers into the same number of cells."""
    for delimiter in "\t;,| ":
        rows = [split(line, delimiter) for line in lines if not _COMMENT.match(line)]
        counts = Counter(len(row) for row in rows if row and is_number(row[0]))
        width, matching = counts.most_common(1)[0] if counts else (0, 0)
        if width > 1 and matching >= 0.9 * counts.total():
            return delimiter
    return ","


def _first_numbers(rows: list[list[str]], lines: list[str]) -> int | None:
    """Index of the first row of numbers; most rows after it must be rows of numbers as well."""
    widths = Counter(len(row) for row in rows if _holds_numbers(row))
    width = widths.most_common(1)[0][0] if widths else 0
    good = [
        len(row) == width and _holds_numbers(row) and not _COMMENT.match(line)
        for row, line in zip(rows, lines, strict=True)
    ]
    if not any(good):
        return None
    first = good.index(True)
    if _is_above_titles(rows, lines, first, width):
        first = good.index(True, first + 1) if any(good[first + 1 :]) else first
    filled = sum(bool(line.strip()) for line in lines[first:])
    return first if sum(good) >= 0.5 * filled else None


def _is_above_titles(rows: list[list[str]], lines: list[str], first: int, width: int) -> bool:
    """Whether a row of numbers is one of identifiers: no names stand above it, but just below."""
    below = rows[first + 1] if first + 1 < len(rows) else []
    named = len(below) == width and not any(is_number(cell) for cell in below) and any(below)
    above = next((row for row in reversed(rows[:first]) if any(row)), [])
    return named and len(above) != width and not _COMMENT.match(lines[first + 1])


def _holds_numbers(row: list[str]) -> bool:
    filled = [cell for cell in row if not is_missing(cell)]
    numbers = sum(map(is_number, filled))
    return bool(filled) and numbers >= 0.5 * len(filled) and is_number(filled[0])


def _titles(lines: list[str], delimiter: str, width: int) -> list[_Row]:
    """Last rows above the numbers that have as many cells as the numbers."""
    rows = [
        _Row(index, split(_COMMENT.sub("", line, count=1), delimiter))
        for index, line in enumerate(lines)
        if line.strip(",; \t")
    ]
    found: list[_Row] = []
    for row in reversed(rows):
        fits = width - 1 <= len(row.cells) <= width + 1
        line = lines[row.index]
        if not fits and (_COMMENT.match(line) or _SECTION.fullmatch(line)):
            continue  # a remark or a title between the names and the numbers
        if not fits or len(found) == HEADER_ROWS:
            break
        found.insert(0, _Row(row.index, (row.cells + [""] * width)[:width]))
    return found


def _names_and_units(above: list[_Row], *, motec: bool) -> tuple[_Row | None, _Row | None]:
    """Row of the names and row of the units, of the rows above the numbers."""
    if len(above) < 2:
        return (above[-1] if above else None), None
    upper, lower = above[-2:]
    if motec or _are_units(lower.cells):
        return upper, lower
    if _are_units(upper.cells):
        for names in (lower, *above[:-2]):
            if _time_agrees(names.cells, upper.cells):
                return names, upper
    return lower, None


def _time_agrees(names: list[str], units: list[str]) -> bool:
    """Whether a column that is called time has a unit of time."""
    return any(
        is_time_name(name) and unit.strip("()[]").casefold() in _TIME_UNITS
        for name, unit in zip(names, units, strict=True)
    )


def _are_units(row: list[str]) -> bool:
    """Whether a row holds units: most cells are known units, and nearly all others look like units.

    A logger has units of its own, such as MoTeC's LA for lambda; no name of a column is that short.
    """
    filled = [cell.strip("()[]") for cell in row if cell]
    known = sum(is_unit(cell) for cell in filled)
    like_units = sum(is_unit(cell) or bool(_UNIT_LIKE.fullmatch(cell)) for cell in filled)
    return bool(filled) and 2 * known >= len(filled) and like_units >= LIKE_UNITS * len(filled)


def _split_units(titles: list[str]) -> list[tuple[str, str]]:
    """Names and units of titles. Brackets that alone distinguish columns stay: G(x), G(y)."""
    pairs = [split_unit(title) for title in titles]
    count = Counter(name for name, _ in pairs)
    return [
        (title, "") if count[name] > 1 and unit and not is_unit(unit) else (name, unit)
        for title, (name, unit) in zip(titles, pairs, strict=True)
    ]


def unique_names(names: list[str]) -> tuple[str, ...]:
    """Names of columns, numbered where several share one; "" for the empty last column."""
    taken = set(names)
    count: Counter[str] = Counter()
    unique = []
    for name in names:
        count[name] += 1
        full = name if count[name] == 1 else f"{name} #{count[name]}"
        while count[name] > 1 and full in taken:
            count[name] += 1
            full = f"{name} #{count[name]}"
        taken.add(full)
        unique.append(full)
    return tuple(unique)
