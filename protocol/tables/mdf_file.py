"""Read MDF files of decoded channels, as INCA, CANape and data loggers write them."""

from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from slipbench.protocol.extras import optional_library
from slipbench.protocol.logs.through_asammdf import opened
from slipbench.protocol.tables.table import Table


def read_mdf(path: Path) -> Table:
    """Table of every channel with one value per sample; each group has its own time column.

    Groups differ in length, so the shorter columns end in empty cells. Times are s since 1970 where
    the file states its start.
    """
    with opened(path) as mdf:
        start = mdf.header.start_time.timestamp()
        groups = [_group(mdf, index) for index in range(len(mdf.groups))]
    names = Counter(name for _, signals in groups for name in signals)
    columns: dict[str, Any] = {}
    units: dict[str, str] = {}
    clocks: dict[str, str] = {}
    for index, (times, signals) in enumerate(groups):
        clock = f"time #{index + 1}"
        if signals:
            columns[clock], units[clock] = times + start, "s"
        for plain, (values, unit) in signals.items():
            name = f"{plain} #{index + 1}" if names[plain] > 1 else plain
            columns[name], units[name], clocks[name] = values, unit, clock
    return Table(str(path), _padded(columns), units, clocks)


def _group(mdf: Any, index: int) -> tuple[np.ndarray, dict[str, tuple[np.ndarray, str]]]:
    """Times of a group, and its channels by name, each with its unit."""
    master = mdf.masters_db.get(index)
    signals: dict[str, tuple[np.ndarray, str]] = {}
    for number, channel in enumerate(mdf.groups[index].channels):
        if number == master or channel.name.startswith("CAN_DataFrame"):
            continue
        signal = mdf.get(channel.name, group=index, index=number)
        if signal.samples.ndim == 1 and signal.samples.dtype.names is None:
            signals[channel.name] = (signal.samples, signal.unit or "")
    times = mdf.get_master(index) if signals else np.zeros(0)
    return np.asarray(times, np.float64), signals


def _padded(columns: dict[str, Any]) -> Any:
    pa = optional_library("pyarrow")

    length = max((len(values) for values in columns.values()), default=0)
    return pa.table({name: _column(values, length) for name, values in columns.items()})


def _column(values: np.ndarray, length: int) -> Any:
    pa = optional_library("pyarrow")

    if values.dtype.kind == "S":
        values = np.char.decode(values, "latin-1")
    array = pa.array(values.tolist() if values.dtype.kind in "UO" else values)
    return pa.concat_arrays([array, pa.nulls(length - len(array), array.type)])
