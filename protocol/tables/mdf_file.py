"""Read MDF files of decoded channels, as INCA, CANape and data loggers write them."""

from pathlib import Path
from typing import Any

import numpy as np

from slipbench.protocol.logs.through_asammdf import opened
from slipbench.protocol.tables.groups import Group, table_of_groups
from slipbench.protocol.tables.table import Table


def read_mdf(path: Path) -> Table:
    """Table of every channel with one value per sample; each group has its own time column.

    Times are s since 1970 where the file states its start.
    """
    with opened(path) as mdf:
        start = mdf.header.start_time.timestamp()
        groups = [_group(mdf, index, start) for index in range(len(mdf.groups))]
    return table_of_groups(str(path), groups, ("ASAM MDF, decoded channels",))


def _group(mdf: Any, index: int, start: float) -> Group:
    """Channels of a group by name, with their times."""
    master = mdf.masters_db.get(index)
    signals: dict[str, tuple[Any, str]] = {}
    for number, channel in enumerate(mdf.groups[index].channels):
        if number == master or channel.name.startswith("CAN_DataFrame"):
            continue
        signal = mdf.get(channel.name, group=index, index=number)
        if signal.samples.ndim == 1 and signal.samples.dtype.names is None:
            signals[channel.name] = (signal.samples, signal.unit or "")
    times = mdf.get_master(index) if signals else np.zeros(0)
    return Group(np.asarray(times, np.float64) + start, signals)
