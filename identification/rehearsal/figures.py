"""Figures of the comparison: what the slip does, and what it costs."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from identification.rehearsal.ride import Ridden
from identification.report import drawing as d

COLOURS = (d.MUTED, d.BLUE, d.ORANGE, d.GREEN, d.VIOLET, d.RED)


def scenario_figure(rides: Mapping[str, Ridden]) -> Figure:
    """Draw slip, throttle and spark of all controllers in one scenario."""
    with d.hand():
        figure, axes = d.panels(3, 6.0, [2.0, 1.0, 1.0])
        for (name, r), color in zip(rides.items(), COLOURS, strict=False):
            d.line(axes[0], r.time, 100 * r.slip, color=color, label=name)
            d.line(axes[1], r.time, 100 * r.throttle, color=color)
            d.line(axes[2], r.time, np.degrees(r.spark), color=color)
        target = next(iter(rides.values()))
        d.line(axes[0], target.time, 100 * target.target, color=d.INK, lw=0.8, ls="--",
               label="target")  # fmt: skip
        axes[0].set(ylabel="slip / %")
        axes[1].set(ylabel="throttle / %")
        axes[2].set(ylabel="spark / deg", xlabel="time / s")
        d.legend(axes[0], 6)
    return figure
