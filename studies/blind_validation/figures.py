"""Figures of the proof: what was seen against what there was to see."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib

matplotlib.use("Agg")

import numpy as np
from matplotlib.figure import Figure

from slipbench.studies.blind_validation.counting import Figure as Counted
from slipbench.studies.blind_validation.generator.case import NOTHING
from slipbench.studies.blind_validation.score import NOBODY_SEES, VISIBLE, Judged, what_is_wrong

GOOD, BAD, QUIET = "#1b7f5c", "#c0392b", "#8a8f98"


def draw_figures(cases: Sequence[Judged], rates: Sequence[Counted], folder: Path) -> list[Path]:
    """Draw all figures into a folder; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = {"validation_rates.png": _rates(rates), "validation_visibility.png": _visibility(cases)}
    for name, figure in drawn.items():
        figure.savefig(folder / name, dpi=110)
    return [folder / name for name in drawn]


def _rates(rates: Sequence[Counted]) -> Figure:
    """Every share with its interval, and what is wanted of it."""
    shown = [r for r in rates if r.total]
    figure = Figure(figsize=(9.0, 0.45 * len(shown) + 1.2), layout="constrained")
    axes = figure.add_subplot()
    for y, rate in enumerate(reversed(shown)):
        if rate.wanted:
            width = min(rate.high, 120.0) - rate.low
            axes.barh(y, width, left=rate.low, height=0.7, color="#e7efe9")
        colour = {True: GOOD, False: BAD, None: QUIET}[rate.met]
        axes.plot(np.clip(rate.interval, 0.0, 120.0), [y, y], color=colour, lw=2.5)
        axes.plot(np.clip(rate.percent, 0.0, 120.0), y, "o", color=colour)
    axes.set_yticks(range(len(shown)), [f"{r.text}: {r.shown}" for r in reversed(shown)])
    axes.set_xlim(-1, 101)
    axes.set_xlabel("%; line: 95 % interval; shaded: the goal")
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _visibility(cases: Sequence[Judged]) -> Figure:
    """What became of every case, over what somebody who knows the secret gains."""
    chosen = [c for c in cases if c.sort != NOTHING and not c.failed]
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    axes = figure.add_subplot()
    sorts = sorted({c.sort for c in chosen})
    rng = np.random.default_rng(1)
    for c in chosen:
        y = sorts.index(c.sort) + rng.uniform(-0.25, 0.25)
        good = not what_is_wrong(c)
        colour = QUIET if c.expected is not True and good else GOOD if good else BAD
        axes.plot(max(c.nats, 0.5), y, "o", color=colour, ms=5, alpha=0.8)
    axes.axvspan(NOBODY_SEES, VISIBLE, color="#eee", zorder=0)
    axes.set_xscale("log")
    axes.set_yticks(range(len(sorts)), sorts)
    axes.set_xlabel("nats that the truth gains; left of the band nobody can see it")
    axes.set_title(
        "green: right; red: a miss; grey: nothing to be seen, nothing claimed", fontsize=9
    )
    axes.spines[["top", "right"]].set_visible(False)
    return figure
