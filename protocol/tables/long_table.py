"""Long tables: one row a sample, with the channel's name in a column, as databases export them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.groups import Group, table_of_groups
from slipbench.protocol.tables.number_cells import decimal_of, number, number_expected, numbers
from slipbench.protocol.tables.table import Table
from slipbench.protocol.tables.times import is_time_name, seconds
from slipbench.protocol.tables.titles import split_unit

_NAMES = (
    *("signal", "channel", "name", "parameter", "variable", "quantity", "sensor", "tag", "metric"),
    *("pid", "signalname", "signal_name", "channel_name", "sensor_name"),
    *("kanal", "kanalname", "messgröße", "canal", "voie", "canale", "señal"),
)
_AROUND = ("message", "group", "topic", "gruppe")
_BUSES = ("bus",)
_VALUES = (
    *("value", "values", "reading", "physical_value", "physvalue"),
    *("wert", "messwert", "valeur", "valore", "valor"),
)
_UNITS = ("unit", "units", "einheit", "unité", "unità", "unidad")
MOST_CHANNELS = 5000


@dataclass(frozen=True)
class LongColumns:
    """Columns of a long table. names: one or several, joined by points. unit: "" for none."""

    time: str
    names: tuple[str, ...]
    value: str
    unit: str
    bus: str


def long_columns(titles: Sequence[str]) -> LongColumns | None:
    """Columns of a long table by their titles; None where the titles are those of another one."""
    plain = {split_unit(title)[0].casefold().replace(" ", "_"): title for title in titles}
    times = [title for title in titles if is_time_name(split_unit(title)[0])]
    names = [plain[name] for name in _NAMES if name in plain]
    values = [plain[name] for name in _VALUES if name in plain]
    if not times or len(names) != 1 or len(values) != 1:
        return None
    around = [plain[name] for name in _AROUND if name in plain]
    unit = next((plain[name] for name in _UNITS if name in plain), "")
    bus = next((plain[name] for name in _BUSES if name in plain), "")
    return LongColumns(times[0], (*around, *names), values[0], unit, bus)


def holds_text(table: Table, column: str) -> bool:
    """Whether a column holds text, as that of the names of channels does."""
    pa = optional_library("pyarrow")

    kind = table.data[column].type
    if pa.types.is_dictionary(kind):
        kind = kind.value_type
    return bool(pa.types.is_string(kind) or pa.types.is_large_string(kind))


def by_channel(table: Table, long: LongColumns) -> Table:
    """Table with a column for each channel of a long table, and a time column for each time base.

    Raises InputError, with the line, for a value that is text among numbers, and for a time that
    cannot be read.
    """
    time = seconds(
        table.data[long.time].combine_chunks(), long.time, table.units.get(long.time, ""), table
    )
    labels = _labels(table, long)
    names, index = np.unique(labels, return_inverse=True)
    if names.size > MOST_CHANNELS:
        raise InputError(
            f"{names.size} different names of channels",
            where=table.where,
            expected=f"at most {MOST_CHANNELS}",
            found=f"column {long.names[-1]!r}",
            remedy="is that column the name of the channel?",
        )
    rows = [np.flatnonzero(index == number) for number in range(names.size)]
    groups: dict[bytes, Group] = {}
    decimal = _decimal(table, long)
    for name, at in zip(names.tolist(), rows, strict=True):
        base = groups.setdefault(time[at].tobytes(), Group(time[at], {}))
        values = _values(table, long, name, at, decimal)
        channels = {**base.channels, name: (values, _unit(table, long, at))}
        groups[time[at].tobytes()] = Group(base.time, channels)
    shown = f"long layout: time {long.time!r}, channel {' and '.join(map(repr, long.names))},"
    shown += f" value {long.value!r}, unit {long.unit!r}" if long.unit else f" value {long.value!r}"
    layout = (*table.layout[:1], f"{shown}; {names.size} channels")
    return table_of_groups(table.where, list(groups.values()), layout, table.warnings)


def _labels(table: Table, long: LongColumns) -> npt.NDArray[np.str_]:
    """Name of the channel of each row; with its bus where a name comes from several buses."""
    parts = [_texts(table, column) for column in long.names]
    labels = parts[0]
    for part in parts[1:]:
        labels = np.char.add(np.char.add(labels, "."), part)
    if long.bus:
        buses = _texts(table, long.bus)
        full = np.char.add(np.char.add(buses, "."), labels)
        if np.unique(full).size > np.unique(labels).size:
            return full
    return labels


def _texts(table: Table, column: str) -> npt.NDArray[np.str_]:
    pa = optional_library("pyarrow")

    cells = table.data[column].combine_chunks()
    if cells.null_count:
        row = int(np.flatnonzero(~np.asarray(cells.is_valid()))[0])
        raise InputError(
            f"column {column!r} is empty",
            where=table.at_row(row),
            expected="the name of a channel",
            found="an empty cell",
            remedy="correct or delete that row in a copy",
        )
    return np.array(cells.cast(pa.string()).to_pylist(), np.str_)


def _decimal(table: Table, long: LongColumns) -> str:
    """Decimal mark of the values: that of the table, else the one that they have."""
    pa = optional_library("pyarrow")

    if table.decimal or not pa.types.is_string(table.data[long.value].type):
        return table.decimal or "."
    return decimal_of([[text or "" for text in table.data[long.value].to_pylist()]])[0]


def _values(
    table: Table, long: LongColumns, name: str, at: npt.NDArray[np.intp], decimal: str
) -> Any:
    """Cells of one channel: numbers, or text where none of them is a number."""
    pa = optional_library("pyarrow")

    cells = table.data[long.value].combine_chunks().take(pa.array(at))
    if not pa.types.is_string(cells.type):
        return cells
    texts = cells.to_pylist()
    values = numbers(texts, decimal)
    if not isinstance(values, int):
        return pa.array(values, from_pandas=True)
    if all(number(text or "0", decimal) is None for text in texts if text):
        return cells
    raise InputError(
        f"channel {name!r} holds text",
        where=f"{table.at_row(int(at[values]))}, column {long.value!r}",
        expected=number_expected(decimal),
        found=repr(texts[values]),
        remedy="empty that cell in a copy of the table",
    )


def _unit(table: Table, long: LongColumns, at: npt.NDArray[np.intp]) -> str:
    """Unit of a channel; "" where the table states none. Raises InputError for two units."""
    if not long.unit:
        return ""
    pa = optional_library("pyarrow")

    cells = table.data[long.unit].combine_chunks().take(pa.array(at)).cast(pa.string())
    units = sorted({text for text in cells.unique().to_pylist() if text})
    if len(units) > 1:
        odd = next(row for row, text in zip(at, cells.to_pylist(), strict=True) if text == units[1])
        raise InputError(
            "one channel has several units",
            where=f"{table.at_row(int(odd))}, column {long.unit!r}",
            expected="one unit a channel",
            found=", ".join(units),
            remedy="give each unit a channel of its own",
        )
    return str(units[0]) if units else ""
