"""Tables of channels that were sampled at different times: each group has its own time column."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library
from slipbench.protocol.tables.table import Table

MOST_CELLS = 200_000_000
_NUMBERS = "biuf"  # kinds of numpy's types


@dataclass(frozen=True)
class Group:
    """Channels of one time base. time: (n,) s. channels: values (n,) and unit, by name."""

    time: npt.NDArray[np.float64]
    channels: Mapping[str, tuple[npt.NDArray[Any], str]]


def table_of_groups(
    where: str,
    groups: Sequence[Group],
    layout: tuple[str, ...] = (),
    warnings: tuple[str, ...] = (),
) -> Table:
    """Table with one time column a group; the shorter columns end in empty cells.

    A name that several groups share is numbered by the group, from the first. Raises InputError
    where the table would be too large.
    """
    shared = Counter(name for group in groups for name in group.channels)
    columns: dict[str, Any] = {}
    units: dict[str, str] = {}
    clocks: dict[str, str] = {}
    for number, group in enumerate(groups, 1):
        clock = f"time #{number}"
        if group.channels:
            columns[clock], units[clock] = group.time, "s"
        for plain, (values, unit) in group.channels.items():
            name = _unique(f"{plain} #{number}" if shared[plain] > 1 else plain, columns)
            columns[name], clocks[name] = values, clock
            units |= {name: unit} if unit else {}
    return Table(where, _padded(columns, where), units, clocks, warnings, layout)


def _unique(name: str, taken: Mapping[str, Any]) -> str:
    count = 2
    while (found := name if count == 2 else f"{name} ({count - 1})") in taken:
        count += 1
    return found


def _padded(columns: dict[str, Any], where: str) -> Any:
    pa = optional_library("pyarrow")

    length = max((len(values) for values in columns.values()), default=0)
    if length * len(columns) > MOST_CELLS:
        raise InputError(
            "the table is too large to be read at once",
            where=where,
            expected=f"at most {MOST_CELLS:,} values",
            found=f"{length:,} rows of {len(columns)} columns",
            remedy="write only the channels or the laps that you need",
        )
    return pa.table({name: _column(values, length) for name, values in columns.items()})


def _column(values: Any, length: int) -> Any:
    """Values as a column of `length` cells: NaN stays, what is no number becomes text."""
    pa = optional_library("pyarrow")

    if isinstance(values, np.ndarray):
        if values.dtype.kind == "S":
            values = np.char.decode(values, "latin-1")
        array = pa.array(values if values.dtype.kind in _NUMBERS else values.tolist())
    else:
        array = values
    return pa.concat_arrays([array, pa.nulls(length - len(array), array.type)])
