"""How the bus and the bench ran: load and lateness, drawn where they were recorded."""

import csv
from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from slipbench.identification.report import drawing as d
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.recording.recording import Recording

LIMIT = 60.0  # %, what the database may load the bus with in the worst case


def bus_load(recording: Recording) -> Figure | None:
    """Draw the load of each bus over time."""
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
    """Draw how late the late ticks were, from ticks.csv; nothing where a clock is simulated."""
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
    """Lateness of every late tick, s; None where nothing was recorded."""
    path = recording.folder / "ticks.csv"
    if not path.is_file():
        return None
    with path.open(encoding="utf-8", newline="") as file:
        told = [row.get("lateness_ns") for row in csv.DictReader(file)]
    return np.array([float(lateness) * 1e-9 for lateness in told if lateness])


def _curve(of: Mapping[str, Any]) -> tuple[FloatArray, FloatArray] | None:
    time, load = (np.asarray(of[key], dtype=np.float64) for key in ("time", "load"))
    return (time, load) if time.size > 1 else None
