"""All runs and analyses as one table with a column for each fact, tag and parameter; SQL filters it.

season = Season(refreshed(Path("2026")))
season.rows("tyre = 'new' and mileage > 300")

A parameter has three columns: NAME, NAME_low and NAME_high, its 95 % interval.
"""

import difflib
import re
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from slipbench.identification.season.belonging import joined
from slipbench.identification.season.columns import table_of
from slipbench.identification.season.entry import Entry
from slipbench.identification.season.wide import TABLE, make_wide
from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library

Made = TypeVar("Made")


class Season:
    """The table of a season.

    tags   columns of the tags
    mixed  those that are a number in some runs and a text in others; their column is text
    units  of the parameters, by name
    """

    def __init__(self, entries: Sequence[Entry]) -> None:
        """Make the table. Raises InputError where duckdb is missing."""
        duckdb = optional_library("duckdb")
        self._error: type[Exception] = duckdb.Error
        self.entries = joined(entries)
        base = duckdb.connect(":memory:")
        base.register("entries", table_of(self.entries))
        kinds = make_wide(base)
        base.execute("SET enable_external_access = false")  # a filter reads no other file
        self.tags = tuple(kinds)
        self.mixed = tuple(name for name, (always, ever) in kinds.items() if ever and not always)
        self.units = {p.name: p.unit for one in self.entries for p in one.parameters}
        self._base, self._table = base, base.table(TABLE)

    @property
    def columns(self) -> list[str]:
        """Names of all columns."""
        return list(self._table.columns)

    @property
    def numeric(self) -> list[str]:
        """Columns that a trend may run over: numbers other than parameters, and the date."""
        kinds = ("DOUBLE", "BIGINT", "TIMESTAMP")
        found = zip(
            self.plain_columns,
            self._table.project(", ".join(self.plain_columns)).types,
            strict=True,
        )
        return [name for name, kind in found if str(kind) in kinds and name not in self.units]

    def rows(self, where: str | None = None) -> list[dict[str, Any]]:
        """Rows for which an SQL expression holds, newest first. Raises InputError where it is none."""
        found = self._filtered(where).fetchall()
        return [dict(zip(self.columns, row, strict=True)) for row in found]

    def arrow(self, where: str | None = None) -> Any:
        """The same rows as an Arrow table. Raises InputError."""
        return self._filtered(where).to_arrow_table()

    def projected(self, columns: str, where: str | None = None) -> tuple[list[str], list[Any]]:
        """Names and rows of SQL expressions, such as "name, mileage / 1000 AS thousand".

        Raises InputError where they are none.
        """
        relation = self._filtered(where)
        made = self._checked(lambda: relation.project(columns), columns, "--columns")
        return list(made.columns), self._checked(made.fetchall, columns, "--columns")

    def _filtered(self, where: str | None) -> Any:
        relation = self._table
        if where is not None:
            relation = self._checked(lambda: relation.filter(where), where, "--where")
            self._checked(relation.fetchall, where, "--where")  # values may be at fault as well
        return relation.order("date DESC NULLS LAST, path, kind")

    @property
    def plain_columns(self) -> list[str]:
        """Columns without the bounds of intervals."""
        return [name for name in self.columns if not name.endswith(("_low", "_high"))]

    def _checked(self, make: Callable[[], Made], text: str, option: str) -> Made:
        try:
            return make()
        except self._error as fault:
            raise self._refused(str(fault), text, option) from fault

    def _refused(self, fault: str, text: str, option: str) -> InputError:
        unknown = re.search(r'column "([^"]+)" not found', fault)
        if unknown is None:
            said = " ".join(fault.split("\n\n")[0].split("\nCandidate")[0].split())
            return InputError(
                "this SQL expression cannot be evaluated",
                where=option,
                expected="an expression such as tyre = 'new' and mileage > 300",
                found=f"{text}: {said}",
            )
        name = unknown[1]
        near = difflib.get_close_matches(name.lower(), self.columns, n=1, cutoff=0.5)
        hint = f"did you mean {near[0]!r}?" if near else f"columns: {', '.join(self.plain_columns)}"
        if f'"{name}"' in text:
            hint = f"a text is in single quotes: '{name}'; {hint}"
        return InputError(f"there is no column {name!r}", where=option, remedy=hint)
