"""Samples of one column of a table, on the table's own clock."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.recording.role_map import TableRules
from slipbench.protocol.tables.dates import DATE_NAME
from slipbench.protocol.tables.number_cells import number_expected, numbers
from slipbench.protocol.tables.table import Table
from slipbench.protocol.tables.times import dates, is_time_name, seconds
from slipbench.protocol.tables.titles import is_time_unit
from slipbench.protocol.units import is_unit

FloatArray = npt.NDArray[np.float64]
_LONGEST_OF_DAY = 3 * 86_400.0  # s: times of day go on after midnight; dates would be far above


@dataclass(frozen=True)
class Samples:
    """time: (n,) s on the table's clock, not decreasing. value: (n,) in `unit`. No NaN in either.

    clock    name of the time column; "" where a sample period stands in for it
    """

    time: FloatArray
    value: FloatArray
    unit: str
    clock: str
    warnings: tuple[str, ...] = ()

    def select(self, keep: npt.NDArray[np.bool_]) -> "Samples":
        """The samples where `keep`, shape (n,), is True."""
        return replace(self, time=self.time[keep], value=self.value[keep])


def samples(table: Table, column: str, time_column: str, rules: TableRules) -> Samples:
    """Samples of one column; empty cells and cells without a number are no samples.

    Raises InputError for a column that is missing or holds text, and for a missing time column.
    """
    name = table.find(column)
    time, clock, doubts = _time(table, name, time_column, rules)
    value = _numbers(table, name)
    known = np.isfinite(time) & np.isfinite(value)
    lost = int(np.sum(np.isfinite(value) & ~np.isfinite(time)))
    warnings = [f"{table.where}: {name}: {lost} values without a time are omitted"] if lost else []
    warnings += doubts
    time, value = time[known], value[known]
    order = _order(time, f"{table.where}: {clock or name}", warnings)
    return Samples(time[order], value[order], table.units.get(name, ""), clock, tuple(warnings))


def _time(
    table: Table, name: str, time_column: str, rules: TableRules
) -> tuple[FloatArray, str, list[str]]:
    """Times in s, the name of their column, and doubts about them."""
    if rules.sample_period is not None and not time_column:
        return np.arange(table.data.num_rows) * rules.sample_period, "", []
    known = time_column or rules.time_column or table.clocks.get(name)
    clock = table.find(known or time_column_of(table))
    unit = rules.time_unit or table.units.get(clock, "")
    if (clock, unit) not in table.times:
        time = seconds(table.data[clock].combine_chunks(), clock, unit, table)
        table.times[clock, unit] = _dated(table, clock, time)
    dated, doubts = table.times[clock, unit]
    return dated, clock, doubts


def _dated(table: Table, clock: str, time: FloatArray) -> tuple[FloatArray, list[str]]:
    """Times of day on the date of the table's first row, where it has a column of dates."""
    pa = optional_library("pyarrow")

    kind = table.data[clock].type
    date = next((name for name in table.names if DATE_NAME.fullmatch(name)), "")
    if not date or not (pa.types.is_string(kind) or pa.types.is_time(kind)):
        return time, []
    midnights, doubtful = dates(table.data[date].combine_chunks())
    known = midnights[np.isfinite(midnights)]
    if not known.size or (np.isfinite(time) & (time >= _LONGEST_OF_DAY)).any():
        return time, []
    doubt = f"{table.where}: {date}: day and month may be exchanged; read as month/day"
    return time + known[0], [doubt] if doubtful else []


def time_column_of(table: Table) -> str:
    """Name of the table's time column: one that is called so, else the first if in a unit of time.

    Raises InputError where there is none.
    """
    found = [name for name in table.names if is_time_name(name) and _may_be_time(table, name)]
    if found:
        return found[0]
    if table.names and is_time_unit(table.units.get(table.names[0], "")):
        return table.names[0]
    raise InputError(
        "the table has no time column",
        where=table.where,
        expected='a column called "Time", "t" or "timestamp"',
        found=", ".join(table.names[:40]),
        remedy='in the role map, under [tables.NAME], give time_column = "..." or, for samples at'
        ' one rate, sample_period = "2 ms"',
    )


def _may_be_time(table: Table, name: str) -> bool:
    """Whether the unit of a column allows times: German "Tempo [km/h]" is a speed."""
    unit = table.units.get(name, "")
    return not unit or is_time_unit(unit) or not is_unit(unit)


def _numbers(table: Table, name: str) -> FloatArray:
    """Values of a column, NaN where a cell is empty. Text among numbers raises."""
    pa = optional_library("pyarrow")

    column = table.data[name].combine_chunks()
    if pa.types.is_boolean(column.type):
        column = column.cast(pa.int8())
    if pa.types.is_null(column.type):
        return np.full(len(column), np.nan)
    if pa.types.is_string(column.type):
        raise _text_among_numbers(table, name, column)
    try:
        numbers = column.cast(pa.float64(), safe=False)
    except (pa.ArrowInvalid, pa.ArrowNotImplementedError) as cause:
        raise InputError(
            f"column {name!r} holds no numbers",
            where=table.where,
            found=str(column.type),
            remedy="bind another column",
        ) from cause
    return np.asarray(numbers.to_numpy(zero_copy_only=False), np.float64)


def _text_among_numbers(table: Table, name: str, column: Any) -> InputError:
    texts = column.to_pylist()
    decimal = table.decimal or "."
    found = numbers(texts, decimal)
    row = found if isinstance(found, int) else 0
    return InputError(
        f"column {name!r} holds text",
        where=f"{table.at_row(row)}, column {table.names.index(name) + 1}",
        expected=number_expected(decimal),
        found=repr(texts[row]),
        remedy="empty that cell in a copy of the table, or bind another column",
    )


def _order(time: FloatArray, where: str, warnings: list[str]) -> npt.NDArray[np.intp]:
    """Order of the samples by time, stable; a warning where that changes it."""
    back = np.flatnonzero(np.diff(time) < 0)
    if back.size:
        largest = -float(np.diff(time)[back].min())
        doubt = "; two recordings in one table?" if largest > 1.0 else ""
        warnings.append(
            f"{where}: not in order of time: {back.size} steps back, the largest {largest:g} s,"
            f" the first at {time[back[0] + 1]:.6f} s; sorted{doubt}"
        )
    return np.argsort(time, kind="stable")
