"""Figure of a trend: values with intervals, the line with its interval, change points."""

from datetime import timedelta
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib import dates
from matplotlib.figure import Figure

from slipbench.identification.report import drawing as d
from slipbench.identification.season.entry import LEVEL
from slipbench.identification.season.points import DATE, EPOCH, TIME
from slipbench.identification.season.trend import Trend, curve
from slipbench.protocol.errors import InputError
from slipbench.protocol.new_file import new_file

FORMATS = (".png", ".svg", ".pdf")


def figure(of: Trend) -> Figure:
    """Values over the abscissa with 95 % intervals, in the unit of the parameter."""
    points = of.points
    made, (axes,) = d.panels(1, 4.2)
    dated = points.over in (DATE, TIME)
    x = np.array([EPOCH + timedelta(days=one) for one in points.x]) if dated else points.x
    drawn = curve(of)
    ends = [0, *(one.after for one in of.changes), points.x.size]
    for first, last in pairwise(ends):
        part = slice(first, last)
        axes.fill_between(x[part], drawn[part, 1], drawn[part, 2], color=d.BLUE, alpha=0.15, lw=0)
        axes.plot(x[part], drawn[part, 0], color=d.BLUE)
    for one in of.changes:
        axes.axvspan(x[one.after - 1], x[one.after], color=d.ORANGE, alpha=0.18, lw=0)
    bars = LEVEL * points.deviation if points.deviation.any() else None
    axes.errorbar(x, points.value, bars, fmt="o", ms=4, color=d.INK, ecolor=d.MUTED, capsize=2)
    axes.set_title(f"{points.parameter} over {points.over}")
    unit = f", {points.unit}" if points.unit not in ("1", "SI") else ""
    axes.set_ylabel(f"{points.parameter.replace('_', ' ')}{unit}")
    axes.set_xlabel("" if dated else points.over)
    if dated:
        ticks = dates.ConciseDateFormatter(axes.xaxis.get_major_locator())  # type: ignore[no-untyped-call]
        axes.xaxis.set_major_formatter(ticks)
    return made


def write_figure(of: Trend, path: Path) -> None:
    """Write the figure into a new file. Raises InputError for another suffix, or an existing file."""
    if path.suffix not in FORMATS:
        raise InputError(
            "a figure of this format is not written",
            where=str(path),
            expected=f"a name that ends with {', '.join(FORMATS)}",
        )
    with d.style(), new_file(path) as draft:
        figure(of).savefig(draft, format=path.suffix[1:], dpi=150)
