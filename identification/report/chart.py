"""A chart as data: drawn by matplotlib for print, by the page's script for zoom and cursor."""

import math
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slipbench.identification.report import drawing as d
from slipbench.protocol.recording.channel import FloatArray

KEPT = 6000  # points of a trace in the page; more of them would make the report too large
DIGITS = 5
COLUMNS = 2  # of a legend
LEGEND_ROW = 0.2  # in, of each row beyond the first


@dataclass(frozen=True)
class Trace:
    """One line of a panel.

    x, y        (n,) in the panel's units; NaN is a gap
    low, high   (n,) of its 95 % interval, or None
    points      drawn as points instead of a line; marker: "o", or "x" as of a pole
    faint       drawn thin and pale
    notes       what the cursor shows beside each point, (n,), or none
    """

    label: str
    x: FloatArray
    y: FloatArray
    colour: str = d.BLUE
    low: FloatArray | None = None
    high: FloatArray | None = None
    points: bool = False
    marker: Literal["o", "x"] = "o"
    dashed: bool = False
    faint: bool = False
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Panel:
    """Traces over common axes.

    x_log, y_log  logarithmic axes
    gain          the page shows y in dB or linear, as the reader chooses; y is linear here
    plane         x is no abscissa: the cursor takes the nearest point of a trace
    level         dashed horizontal line, such as a limit
    shade         (start, end) on the abscissa, shaded
    """

    traces: tuple[Trace, ...]
    y_label: str
    x_label: str = ""
    title: str = ""
    x_log: bool = False
    y_log: bool = False
    gain: bool = False
    plane: bool = False
    level: tuple[float, ...] = ()
    shade: tuple[tuple[float, float], ...] = ()
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    height: float = 2.2  # in, of the printed figure


@dataclass(frozen=True)
class Chart:
    """Panels one above the other; `linked`: they share their abscissa."""

    panels: tuple[Panel, ...]
    linked: bool = True
    side: bool = field(default=False)  # printed side by side


def static(chart: Chart) -> Figure:
    """The chart as a matplotlib figure."""
    if chart.side:
        figure, axes = d.side_by_side(len(chart.panels), chart.panels[0].height)
    else:
        heights = [panel.height for panel in chart.panels]
        more = LEGEND_ROW * max(_legend_rows(chart.panels[0]) - 1, 0)
        height = 0.8 + more + sum(heights)
        figure, axes = d.panels(len(heights), height, heights, top=0.4 + more)
    for axis, panel in zip(axes, chart.panels, strict=True):
        _draw(axis, panel)
    return figure


def _draw(axes: Axes, panel: Panel) -> None:
    for start, end in panel.shade:
        axes.axvspan(start, end, color=d.SHADE, lw=0)
    for one in panel.traces:
        _draw_trace(axes, one)
    for level in panel.level:
        axes.axhline(level, color=d.MUTED, lw=0.9, ls=(0, (4, 3)))
    axes.set(ylabel=panel.y_label, xlabel=panel.x_label, title=panel.title)
    if panel.x_log:
        axes.set_xscale("log")
        d.plain_frequency(axes)
    axes.set_yscale("log" if panel.y_log else "linear")
    axes.set_xlim(panel.x_range)
    axes.set_ylim(panel.y_range)
    if _legend_entries(panel):
        d.legend(axes, COLUMNS)


def _legend_entries(panel: Panel) -> int:
    """Return how many traces a legend names; a title, in its place, names a single one."""
    named = sum(bool(one.label) for one in panel.traces)
    return 0 if panel.title and named == 1 else named


def _legend_rows(panel: Panel) -> int:
    return math.ceil(_legend_entries(panel) / COLUMNS)


def _draw_trace(axes: Axes, one: Trace) -> None:
    if one.low is not None and one.high is not None:
        axes.fill_between(one.x, one.low, one.high, color=one.colour, alpha=0.18, lw=0)
    look: dict[str, Any] = {"color": one.colour, "label": one.label or None}
    if one.points:
        axes.plot(one.x, one.y, one.marker, ms=6 if one.marker == "x" else 3.5, **look)
    elif one.faint:
        axes.plot(one.x, one.y, alpha=0.5, lw=0.8, **look)
    else:
        axes.plot(*d.thinned(one.x, one.y), ls="--" if one.dashed else "-", **look)


def tree(chart: Chart) -> dict[str, Any]:
    """The chart for the page's script: numbers of 5 digits, null for gaps."""
    return {
        "linked": chart.linked,
        "side": chart.side,
        "panels": [
            {
                "title": panel.title,
                "x": panel.x_label,
                "y": panel.y_label,
                "xLog": panel.x_log,
                "yLog": panel.y_log,
                "gain": panel.gain,
                "plane": panel.plane,
                "level": list(panel.level),
                "shade": [list(one) for one in panel.shade],
                "xRange": panel.x_range and list(panel.x_range),
                "yRange": panel.y_range and list(panel.y_range),
                "height": round(96 * panel.height),
                "traces": [_trace_tree(one, panel.plane) for one in panel.traces],
            }
            for panel in chart.panels
        ],
    }


def _trace_tree(one: Trace, plane: bool) -> dict[str, Any]:
    whole = plane or one.points or one.low is not None
    x, y = (one.x, one.y) if whole else d.thinned(one.x, one.y, KEPT)
    made: dict[str, Any] = {
        "label": one.label,
        "colour": one.colour,
        "x": _numbers(x, 7),
        "y": _numbers(y),
        "points": one.points,
        "marker": one.marker,
        "dashed": one.dashed,
        "faint": one.faint,
    }
    if one.low is not None and one.high is not None:
        made |= {"low": _numbers(one.low), "high": _numbers(one.high)}
    if one.notes:
        made["notes"] = list(one.notes)
    return made


def _numbers(values: FloatArray, digits: int = DIGITS) -> list[float | None]:
    return [
        float(f"{v:.{digits}g}") if math.isfinite(v) else None
        for v in np.asarray(values, dtype=float).tolist()
    ]
