"""Figures of the comparison: slip, throttle and spark over time."""

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure

from slipbench.identification.closed_loop_simulation.ride import TICK, Ridden
from slipbench.identification.report import drawing as d

COLOURS = (d.BLUE, d.ORANGE, d.GREEN, d.VIOLET, d.RED)
SHOWN = 6.0  # s at most


def scenario_figure(rides: Mapping[str, Ridden]) -> Figure:
    """Figure of slip, throttle and spark of all controllers in one scenario."""
    shown = slice(0, round(SHOWN / TICK))
    with d.style():
        figure, axes = d.panels(3, 6.0, [2.0, 1.0, 1.0])
        colours = iter(COLOURS)
        for name, r in rides.items():
            color = d.MUTED if name == "open loop" else next(colours)
            d.line(
                axes[0],
                r.time[shown],
                100 * r.slip[shown],
                color=color,
                label=name.replace("_", " "),
            )
            d.line(axes[1], r.time[shown], 100 * r.throttle[shown], color=color)
            d.line(axes[2], r.time[shown], np.degrees(r.spark[shown]), color=color)
        first = next(iter(rides.values()))
        d.line(
            axes[0],
            first.time[shown],
            100 * first.target[shown],
            color=d.INK,
            lw=0.8,
            ls="--",
            label="setpoint",
        )
        axes[0].set(ylabel="slip / %")
        axes[1].set(ylabel="throttle / %")
        axes[2].set(ylabel="spark / deg", xlabel="time / s")
        d.legend(axes[0], 6)
    return figure
