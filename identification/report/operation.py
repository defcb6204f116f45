"""Figures of bus load and tick lateness."""

import csv
from collections.abc import Mapping
from io import StringIO
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from slipbench.identification.report import drawing as d
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.user_file import read_user_file

LARGEST = 1 << 28  # bytes of ticks.csv: three hours have a third of it
LIMIT = 60.0  # %, worst-case bus load allowed for the database


def bus_load(recording: Recording) -> Figure | None:
    """Figure of the load of each bus over time; None where it was not recorded."""
    curves = {bus: _curve(of) for bus, of in recording.bus_load.items()}
    drawn = {bus: curve for bus, curve in curves.items() if curve is not None}
    if not drawn:
        return None
    figure, (axes,) = d.panels(1, 2.4)
    for (bus, (time, load)), colour in zip(
        drawn.items(), (d.BLUE, d.ORANGE, d.GREEN), strict=False
    ):
        d.line(axes, time, load * 100, color=colour, label=bus)
    axes.axhline(LIMIT, color=d.MUTED, lw=0.9, ls=(0, (4, 3)))
    axes.set(xlabel="time / s", ylabel="bus load / %", ylim=(0, None))
    d.legend(axes)
    return figure


def lateness(recording: Recording) -> Figure | None:
    """Histogram of tick lateness from ticks.csv; None with a simulated clock."""
    late = late_ticks(recording)
    if late is None or late.size < 2 or not np.nanmax(late) > 0:
        return None
    figure, (axes,) = d.panels(1, 2.4)
    positive = np.maximum(late[np.isfinite(late)] * 1e6, 0.1)
    edges = np.geomspace(0.1, max(positive.max(), 1.0) * 1.1, 60).tolist()
    axes.hist(positive, bins=edges, color=d.BLUE)
    axes.set(xlabel="lateness / µs", ylabel="ticks", xscale="log", yscale="log")
    return figure


def late_ticks(recording: Recording) -> FloatArray | None:
    """Lateness of every late tick, s, shape (n,); None where it was not recorded.

    Raises InputError where the file is damaged.
    """
    path = recording.folder / "ticks.csv"
    if not path.is_file():
        return None
    try:
        rows = csv.DictReader(StringIO(read_user_file(path, LARGEST).decode("utf-8"), newline=""))
        recorded = [row.get("lateness_ns") for row in rows]
        return np.array([float(lateness) * 1e-9 for lateness in recorded if lateness])
    except (csv.Error, ValueError) as fault:
        raise InputError(
            "the file of tick lateness is damaged",
            where=str(path),
            found=str(fault),
            remedy="restore it, or remove it: the report then has no lateness",
        ) from fault


def _curve(of: Mapping[str, Any]) -> tuple[FloatArray, FloatArray] | None:
    time, load = (np.asarray(of[key], dtype=np.float64) for key in ("time", "load"))
    return (time, load) if time.size > 1 else None
