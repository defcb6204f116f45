"""Find the layout of a CSV file with one row a sample: time, channel, value."""

from slipbench.protocol.tables.csv_layout import Layout, split, unique_names
from slipbench.protocol.tables.long_table import long_columns
from slipbench.protocol.tables.number_cells import decimal_of
from slipbench.protocol.tables.titles import split_unit


def find_long(lines: list[str]) -> Layout | None:
    """Layout of a long table by its row of titles; None where there is no such row."""
    for index, line in enumerate(lines[:-1]):
        for delimiter in "\t;,|":
            if line.count(delimiter) < 2:
                continue
            titles = split(line, delimiter)
            if long_columns(titles) is not None:
                return _layout(lines, index, delimiter, titles)
    return None


def _layout(lines: list[str], index: int, delimiter: str, titles: list[str]) -> Layout:
    pairs = [split_unit(title) for title in titles]
    rows = [split(line, delimiter) for line in lines[index + 1 :] if line.strip()]
    decimal, doubtful = decimal_of(rows)
    return Layout(
        delimiter,
        decimal,
        unique_names([name for name, _ in pairs]),
        tuple(unit for _, unit in pairs),
        index,
        None,
        index + 1,
        doubtful,
    )
