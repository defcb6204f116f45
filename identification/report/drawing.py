"""Common style and helpers of all figures; legible on a phone and on paper."""

import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from slipbench.identification.signals.samples import BoolArray
from slipbench.protocol.recording.channel import FloatArray

INK, MUTED, GRID = "#1c2733", "#66717d", "#dfe4ea"
BLUE, ORANGE, GREEN, RED, VIOLET = "#1f62b0", "#d9680a", "#1d8a5b", "#c23030", "#7a4fb5"
SHADE = "#eaf1fa"
WIDTH = 9.0  # in
POINTS = 1600  # kept of a line; more cannot be resolved

STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 9.5,
    "axes.titlesize": 10.5,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelcolor": INK,
    "axes.edgecolor": "#aab3bd",
    "axes.grid": True,
    "grid.color": GRID,
    "grid.linewidth": 0.7,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "text.color": INK,
    "lines.linewidth": 1.3,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "svg.fonttype": "path",
    "figure.facecolor": "white",
    "axes.facecolor": "white",
}


@contextmanager
def style() -> Iterator[None]:
    """Context in which figures are drawn in the common style."""
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        yield


def panels(
    rows: int,
    height: float,
    ratios: list[float] | None = None,
    right: float = 0.25,
    top: float = 0.4,
) -> tuple[Figure, list[Axes]]:
    """Figure with stacked panels that share their horizontal axis. height, margins: in."""
    figure = Figure(figsize=(WIDTH, height))
    FigureCanvasAgg(figure)
    margins = {"top": 1 - top / height, "bottom": 0.55 / height, "hspace": 0.45 * rows / height}
    grid = figure.subplots(
        rows,
        1,
        sharex=True,
        squeeze=False,
        height_ratios=ratios,
        gridspec_kw={"left": 0.9 / WIDTH, "right": 1 - right / WIDTH, **margins},
    )
    for row in range(rows):
        grid[row, 0].yaxis.set_label_coords(-0.65 / (WIDTH - 1.15), 0.5)
    return figure, [grid[row, 0] for row in range(rows)]


def side_by_side(columns: int, height: float) -> tuple[Figure, list[Axes]]:
    """Figure with panels side by side. height: in."""
    figure = Figure(figsize=(WIDTH, height))
    FigureCanvasAgg(figure)
    margins = {"left": 0.8 / WIDTH, "right": 1 - 0.75 / WIDTH, "wspace": 0.42}
    grid = figure.subplots(
        1,
        columns,
        squeeze=False,
        gridspec_kw={"top": 1 - 0.4 / height, "bottom": 0.6 / height, **margins},
    )
    return figure, list(grid[0])


def line(axes: Axes, x: FloatArray, y: FloatArray, **look: object) -> None:
    """Draw a line, thinned to the visible number of points. x, y: shape (n,)."""
    axes.plot(*thinned(x, y), **look)  # type: ignore[arg-type]


def thinned(x: FloatArray, y: FloatArray, points: int = POINTS) -> tuple[FloatArray, FloatArray]:
    """Minimum and maximum of every segment, so that peaks remain. x, y: shape (n,)."""
    length = x.size // (points // 2)
    if length < 3:
        return x, y
    rows = x.size // length
    table = y[: rows * length].reshape(rows, length)
    unknown = np.isnan(table).all(axis=1)
    low = np.argmin(np.where(np.isnan(table), np.inf, table), axis=1)
    high = np.argmax(np.where(np.isnan(table), -np.inf, table), axis=1)
    pairs = np.sort(np.stack((low, high), axis=1), axis=1) + np.arange(rows)[:, None] * length
    kept = pairs.ravel()
    return x[kept], np.where(np.repeat(unknown, 2), np.nan, y[kept])


def shade(axes: Axes, time: FloatArray, active: BoolArray, label: str = "") -> None:
    """Shade the time spans in which `active` is true. time: s, shape (n,); active: shape (n,)."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], active.astype(int), [0]))))
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        axes.axvspan(time[start], time[min(end, time.size - 1)], color=SHADE, lw=0, label=label)
        label = ""


def legend(axes: Axes, columns: int = 4) -> None:
    """Place the legend above the panel, where it covers no data."""
    axes.legend(
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        ncols=columns,
        borderaxespad=0.1,
        handlelength=1.6,
        columnspacing=1.4,
    )


def plain_decades(gain: Axes, frequency: Axes) -> None:
    """Label logarithmic gain and frequency axes with plain numbers."""
    gain.yaxis.set_major_locator(LogLocator(base=10, subs=(1, 2, 5)))
    gain.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:.3g}"))
    gain.yaxis.set_minor_formatter(FuncFormatter(lambda *_: ""))
    plain_frequency(frequency)


def plain_frequency(frequency: Axes) -> None:
    """Label a logarithmic frequency axis with plain numbers."""
    frequency.xaxis.set_major_locator(LogLocator(base=10, subs=(1, 2, 3, 5, 7)))
    frequency.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    frequency.xaxis.set_minor_formatter(FuncFormatter(lambda *_: ""))


def svg(figure: Figure, name: str) -> str:
    """Inline SVG of a figure; the same figure gives the same bytes."""
    buffer = io.StringIO()
    look = {**STYLE, "svg.hashsalt": name}
    with mpl.rc_context(look):  # type: ignore[arg-type]
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    return text[text.index("<svg") :].replace("<svg ", f'<svg role="img" aria-label="{name}" ', 1)


def png(figure: Figure, path: Path, dots: int = 160) -> None:
    """Write a figure as PNG. dots: dots per inch."""
    with mpl.rc_context(STYLE):  # type: ignore[arg-type]
        figure.savefig(path, format="png", dpi=dots)
