"""Figure of the free curves: as localized, and as fitted inside the simulation."""

import numpy as np
from matplotlib.axes import Axes

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.reporting.conclude import in_written_units
from slipbench.identification.mismatch.simulation.regressor import (
    HYSTERESIS,
    PAST,
    ROUNDS,
    SCALE,
    TURN,
    change_after_reversal,
    quantity_of,
    step_response,
)
from slipbench.identification.mismatch.simulation.system import System
from slipbench.identification.report import drawing as d
from slipbench.plant.signals import Floats

SOON = 0.01
"""Time after a step up to which the time axis is linear, s."""


def curve_svg(located: Curve, inside: Curve | None, system: System) -> str:
    """Draw estimated curves over their regressors, in the units of the system's file.

    inside: curve fitted in the simulation; in the same panel if place and regressor are the same.
    """
    drawn_curves = [(located, d.BLUE, "localized")]
    drawn_curves += [(inside, d.GREEN, "in the simulation")] if inside else []
    separate_panels = inside is not None and not _same_place_and_regressor(located, inside)
    with d.style():
        figure, panels = d.side_by_side(2, 3.0) if separate_panels else d.panels(1, 2.8)
        for drawn, colour, label in drawn_curves:
            axes = panels[-1] if drawn is inside else panels[0]
            curve, unit = in_written_units(drawn, system)
            axes.axhline(0.0, color=d.MUTED, lw=0.8)
            axes.plot(*_points(curve), color=colour, marker="o", ms=4, label=label)
            d.legend(axes, 2)
            _label(axes, curve, unit)
        return d.svg(figure, "located")


def _same_place_and_regressor(one: Curve, other: Curve) -> bool:
    return (one.place, one.regressor) == (other.place, other.regressor)


def _label(axes: Axes, curve: Curve, unit: str) -> None:
    quantity = quantity_of(curve.regressor)
    if curve.kind == PAST:
        axes.set_xscale("symlog", linthresh=SOON)
        axes.set(
            xlabel=f"time after a step of {quantity} / s",
            ylabel=f"{curve.place} / ({curve.unit} per {unit})",
        )
    elif curve.kind == HYSTERESIS:
        axes.set(
            xlabel=f"travel of {quantity} after a reversal / {unit}",
            ylabel=f"{curve.place} / {curve.unit}",
        )
    elif curve.kind == SCALE:
        axes.set(xlabel=f"{quantity} / {unit}", ylabel=f"{curve.place}, relative change")
    else:
        axes.set(xlabel=f"{quantity} / {unit}", ylabel=f"{curve.place} / {curve.unit}")


def _points(curve: Curve) -> tuple[Floats, Floats]:
    """Return the points of a curve: its knots, a turn, or the step response of a history."""
    if curve.kind == HYSTERESIS:
        travel = np.linspace(0.0, 2.0 * float(curve.knots.max()), 81)
        return travel, change_after_reversal(curve.knots, curve.values, travel)
    if curve.kind == TURN and curve.knots.size in ROUNDS:
        angle = np.linspace(0.0, 2.0 * np.pi, 181)
        return angle, curve(angle)
    if curve.kind != PAST:
        return curve.knots, curve.values
    return curve.knots, step_response(curve.knots, curve.values, curve.knots)
