"""Table as a logger exported it: named columns with units and time columns."""

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from slipbench.protocol.errors import InputError
from slipbench.protocol.tables.titles import split_unit


@dataclass(frozen=True)
class Table:
    """Columns of one file, as read.

    where     the file, for messages
    data      pyarrow.Table; a column that is not all numbers is text, timestamps or truth values
    units     column -> unit, where the file states one
    clocks    column -> its time column, where the file states it
    warnings  of reading it
    layout    how the file was read: what was recognized and what was guessed, a line each
    lines     (row, line) where the file's lines begin to differ from the rows by another number:
              rows from 0, lines from 1; empty where the file has no lines
    decimal   mark in the numbers of its text columns; "" where it was not specified
    times     of each time column, by name and unit, once they were read from it
    """

    where: str
    data: Any
    units: Mapping[str, str] = field(default_factory=dict)
    clocks: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    layout: tuple[str, ...] = ()
    lines: tuple[tuple[int, int], ...] = ()
    decimal: str = ""
    times: dict[tuple[str, str], Any] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def names(self) -> list[str]:
        """Names of the columns, as in the file but for a unit in brackets."""
        return list(self.data.column_names)

    def at_row(self, row: int) -> str:
        """File, and the line of a row, which counts from 0; the row itself where there are no lines."""
        before = [(first, line) for first, line in self.lines if first <= row]
        if not before:
            return f"{self.where}: data row {row + 1}"
        first, line = before[-1]
        return f"{self.where}: line {line + row - first}"

    def find(self, title: str) -> str:
        """Name of the column called `title`: with or without its unit, or behind "MESSAGE.".

        Raises InputError where there is none.
        """
        bare = split_unit(title)[0]
        for name in (title, bare):
            if name in self.names:
                return name
        for plain in (str.casefold, _without_message):
            same = [name for name in self.names if plain(name) == bare.casefold()]
            if len(same) == 1:
                return same[0]
        near = difflib.get_close_matches(bare, self.names, n=1, cutoff=0.4)
        raise InputError(
            f"the table has no column {title!r}",
            where=self.where,
            found=", ".join(self.names[:40]),
            remedy=f"did you mean {near[0]!r}?" if near else "name one of these",
        )


def _without_message(name: str) -> str:
    """Name of a signal, in small letters, without the message before it: "ID_140.RPM" -> "rpm"."""
    return name.rpartition(".")[2].casefold()
