"""Columns of a table with properties of their values."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from slipbench.protocol.binding.words import concepts_in
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables import Table, samples
from slipbench.protocol.tables.samples import time_column_of
from slipbench.protocol.tables.times import is_time_name

FloatArray = npt.NDArray[np.float64]
NO_CLOCK = TableRules(sample_period=1.0)
RECEIVERS = ("VBO", "GPX", "FIT")  # formats in which a speed without another name is that of GNSS
STEP = 0.1  # s, of the common time base
MOST_STEPS = 200_000


@dataclass(frozen=True)
class Column:
    """One column of numbers. time: (n,) s, empty where the table has no times. value: (n,), in `unit`.

    clock   name of its time column; "" where there is none
    around  context of all columns, from the name of the file: "gps" or ""
    """

    name: str
    unit: str
    time: FloatArray
    value: FloatArray
    clock: str
    around: str = ""

    @property
    def is_switch(self) -> bool:
        """Whether every value is 0 or 1."""
        return bool(np.isin(self.value, (0.0, 1.0)).all())

    @property
    def rate(self) -> float:
        """Samples a second; 0 where it is not known."""
        span = float(self.time[-1] - self.time[0]) if self.time.size > 1 else 0.0
        return (self.time.size - 1) / span if span > 0 else 0.0

    def describe(self) -> str:
        """Name, unit, range, number and rate of the samples."""
        rate = f" at {self.rate:.4g} Hz" if self.rate else ""
        span = f"{self.value.min():.4g} .. {self.value.max():.4g}"
        return f"{self.name} [{self.unit or 'no unit'}]: {span}, {self.value.size} values{rate}"


@dataclass(frozen=True)
class Columns:
    """Columns of numbers of a table; time_column: "" where there is none. unread: name -> reason."""

    table: Table
    numbers: tuple[Column, ...]
    time_column: str
    unread: dict[str, str]
    warnings: tuple[str, ...]

    def base(self) -> FloatArray:
        """Common time base, (m,) s, over the time of all columns."""
        times = [column.time for column in self.numbers if column.time.size]
        if not times:
            return np.zeros(0)
        start, end = min(t[0] for t in times), max(t[-1] for t in times)
        step = max(STEP, float(end - start) / MOST_STEPS)
        base: FloatArray = np.arange(start, end + step / 2, step)
        return base


def columns_of(table: Table) -> Columns:
    """Columns of numbers of a table, with their times."""
    clock = _clock(table)
    around = _around(table)
    warnings = dict.fromkeys(table.warnings)
    numbers: list[Column] = []
    unread: dict[str, str] = {}
    for name in table.names:
        if name == clock or name in table.clocks.values() or (is_time_name(name) and not clock):
            continue
        try:
            found = samples(
                table, name, "", TableRules() if _has_clock(table, name, clock) else NO_CLOCK
            )
        except InputError as cause:
            unread[name] = f"{cause.what} ({cause.where.rpartition(': ')[2]}: {cause.found})"
            continue
        warnings |= dict.fromkeys(found.warnings)
        if not found.value.size:
            unread[name] = "no number in it"
            continue
        time = found.time if found.clock else np.zeros(0)
        numbers.append(Column(name, found.unit, time, found.value, found.clock, around))
    return Columns(table, tuple(numbers), clock, unread, tuple(warnings))


def _around(table: Table) -> str:
    """Context of all columns of a file: "gps" for a receiver's format or name, else ""."""
    receiver = bool(table.layout) and table.layout[0].startswith(RECEIVERS)
    return "gps" if receiver or "gnss" in concepts_in(Path(table.where).stem) else ""


def _clock(table: Table) -> str:
    """Time column of a table that has one for all others; "" otherwise."""
    if table.clocks:
        return ""
    try:
        return time_column_of(table)
    except InputError:
        return ""


def _has_clock(table: Table, name: str, clock: str) -> bool:
    return bool(clock) or name in table.clocks


def on_base(column: Column, base: FloatArray) -> Iterator[FloatArray]:
    """Values of a column on a common time base, (m,), in its own unit; nothing without times."""
    if column.time.size > 1 and base.size:
        yield np.interp(base, column.time, column.value)
