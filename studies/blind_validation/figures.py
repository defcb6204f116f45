"""Figures of the blind validation: rates with intervals; outcome over visibility; ranks."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib.figure import Figure

from slipbench.studies.blind_validation.counting import Figure as Counted
from slipbench.studies.blind_validation.generator.case import NOTHING
from slipbench.studies.blind_validation.posterior import Uniformity, ranks_of, uniformity
from slipbench.studies.blind_validation.score import NOT_VISIBLE, VISIBLE, ScoredCase, what_is_wrong

GOOD, BAD, QUIET = "#1b7f5c", "#c0392b", "#8a8f98"


def draw_figures(cases: Sequence[ScoredCase], rates: Sequence[Counted], folder: Path) -> list[Path]:
    """Paths of all figures, drawn into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = {"validation_rates.png": _rates(rates), "validation_visibility.png": _visibility(cases)}
    if found := uniformity(ranks_of(cases)):
        drawn["validation_ranks.png"] = _ranks(found)
    for name, figure in drawn.items():
        figure.savefig(folder / name, dpi=110)
    return [folder / name for name in drawn]


def _rates(rates: Sequence[Counted]) -> Figure:
    """Figure of every rate with its 95 % interval and goal."""
    shown = [r for r in rates if r.total]
    figure = Figure(figsize=(9.0, 0.45 * len(shown) + 1.2), layout="constrained")
    axes = figure.add_subplot()
    for y, rate in enumerate(reversed(shown)):
        if rate.has_goal:
            width = min(rate.high, 120.0) - rate.low
            axes.barh(y, width, left=rate.low, height=0.7, color="#e7efe9")
        colour = {True: GOOD, False: BAD, None: QUIET}[rate.met]
        axes.plot(np.clip(rate.interval, 0.0, 120.0), [y, y], color=colour, lw=2.5)
        axes.plot(np.clip(rate.percent, 0.0, 120.0), y, "o", color=colour)
    axes.set_yticks(range(len(shown)), [f"{r.text}: {r.shown}" for r in reversed(shown)])
    axes.set_xlim(-1, 101)
    axes.set_xlabel("%; line: 95 % interval; shaded: goal")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _visibility(cases: Sequence[ScoredCase]) -> Figure:
    """Figure of the outcome of every case over the gain of the ideal observer."""
    chosen = [c for c in cases if c.category != NOTHING and not c.failed]
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    axes = figure.add_subplot()
    categories = sorted({c.category for c in chosen})
    rng = np.random.default_rng(1)
    for c in chosen:
        y = categories.index(c.category) + rng.uniform(-0.25, 0.25)
        good = not what_is_wrong(c)
        colour = QUIET if c.expected is not True and good else GOOD if good else BAD
        axes.plot(max(c.nats, 0.5), y, "o", color=colour, ms=5, alpha=0.8)
    axes.axvspan(NOT_VISIBLE, VISIBLE, color="#eee", zorder=0)
    axes.set_xscale("log")
    axes.set_yticks(range(len(categories)), categories)
    axes.set_xlabel(
        "log-likelihood gain of the ideal observer / nats; left of the band: not visible"
    )
    axes.set_title("green: correct; red: miss; grey: not visible, no alarm", fontsize=9)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _ranks(found: Uniformity) -> Figure:
    """Histogram of the ranks of the truth, with the band of uniform ranks."""
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    axes = figure.add_subplot()
    edges = np.linspace(0.0, 1.0, len(found.counts) + 1)
    axes.axhspan(*found.band, color="#e7efe9")
    axes.stairs(found.counts, edges, fill=True, color=GOOD, alpha=0.7)
    axes.set_xlabel("rank of the truth in the stated posterior; shaded: 99 % of uniform ranks")
    axes.set_ylabel("numbers")
    axes.spines[["top", "right"]].set_visible(False)
    return figure
