"""The figures of the memo: the located curve, and held-out residuals before and after."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.simulation.along import (
    ANGLE,
    HYSTERESIS,
    KNOTS,
    PAST,
    SCALE,
    after_a_turn,
    quantity_of,
    step_response,
)
from slipbench.identification.mismatch.simulation.system import System
from slipbench.identification.mismatch.simulation.written_units import SI, WrittenUnits
from slipbench.identification.mismatch.telling.conclude import in_written_units
from slipbench.identification.report import drawing as d
from slipbench.plant.signals import Floats

SOON = 0.01
"""Seconds after a step up to which time is drawn evenly."""
LOOKS = ((d.ORANGE, "calibrated"), (d.BLUE, "improved"))


def curve_svg(located: Curve, inside: Curve | None, system: System) -> str:
    """Draw estimated curves along their quantities, in the units of the system's file.

    inside: what stands in the simulation: in the same panel where it is of one place and quantity.
    """
    both = [(located, d.BLUE, "localized")]
    both += [(inside, d.GREEN, "in the simulation")] if inside else []
    apart = inside is not None and not _of_one_kind(located, inside)
    with d.style():
        figure, panels = d.side_by_side(2, 3.0) if apart else d.panels(1, 2.8)
        for si, colour, label in both:
            axes = panels[-1] if si is inside else panels[0]
            curve, unit = in_written_units(si, system)
            axes.axhline(0.0, color=d.MUTED, lw=0.8)
            axes.plot(*_points(curve), color=colour, marker="o", ms=4, label=label)
            d.legend(axes, 2)
            _label(axes, curve, unit)
        return d.svg(figure, "located")


def _of_one_kind(one: Curve, other: Curve) -> bool:
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
        axes.set(xlabel=f"{quantity} / {unit}", ylabel=f"{curve.place}, relative {curve.regressor}")
    else:
        axes.set(xlabel=f"{quantity} / {unit}", ylabel=f"{curve.place} / {curve.unit}")


def _points(curve: Curve) -> tuple[Floats, Floats]:
    """The curve at its knots, or round a turn; of the past, its answer to a step."""
    if curve.kind == HYSTERESIS:
        way = np.linspace(0.0, 2.0 * float(curve.knots.max()), 81)
        return way, after_a_turn(curve.knots, curve.values, way)
    if curve.regressor == ANGLE and curve.knots.size == KNOTS:
        turn = np.linspace(0.0, 2.0 * np.pi, 181)
        return turn, curve(turn)
    if curve.kind != PAST:
        return curve.knots, curve.values
    return curve.knots, step_response(curve.knots, curve.values, curve.knots)


def proof_svg(runs: Sequence[Fit], output: str, written: WrittenUnits = SI) -> str:
    """Draw residuals of one output before and after: in time, frequency and orders of the wheel.

    runs: on held-out recordings: the file's system, re-calibrated, with what was found.
    """
    chain = runs[0].model.chain
    si = runs[0].model.records[0].sensors[output].unit
    scale = written.factor(si, output.replace("_", " "))
    b = next(i for i, k in enumerate(chain.blocks) if output in k.outputs)
    j = chain.blocks[b].outputs.index(output)
    pattern = next((i for i, k in enumerate(chain.blocks) if not k.order), None)
    domains = [_time, _frequency] if chain.blocks[b].order else []
    with d.style():
        figure, panels = d.side_by_side(len(domains) + (pattern is not None), 3.2)
        for fit, (colour, label) in zip(runs[1:], LOOKS, strict=True):
            for axes, draw in zip(panels, domains, strict=False):
                draw(axes, fit, b, j, scale, colour, label)
            if pattern is not None:
                _orders(panels[-1], fit, b if not chain.blocks[b].order else pattern, colour, label)
        d.legend(panels[0], 2)
        return d.svg(figure, "held_out")


def _time(
    axes: Axes, fit: Fit, b: int, j: int, scale: tuple[float, str], colour: str, label: str
) -> None:
    record, (factor, unit) = fit.model.records[0], scale
    rest = factor * fit.rest[b][0][:, j]
    d.line(axes, record.grid.centre[: rest.size], rest, color=colour, label=label, lw=0.9)
    axes.set(xlabel="time / s", ylabel=f"measured minus simulated / {unit}")


def _frequency(
    axes: Axes, fit: Fit, b: int, j: int, scale: tuple[float, str], colour: str, label: str
) -> None:
    """Draw the mean spectrum over all recordings, as long as the shortest."""
    factor, unit = scale
    width = fit.model.records[0].grid.width
    length = min(len(r) for r in fit.rest[b])
    window = np.hanning(length)[:, None]
    pieces = factor * np.stack([r[:length, j] for r in fit.rest[b]], axis=1)
    lines = np.abs(np.fft.rfft(pieces * window, axis=0)) * 2.0 / window.sum()
    mean = np.sqrt(np.mean(lines**2, axis=1))
    grid = np.fft.rfftfreq(length, width)
    axes.semilogy(grid[1:], np.maximum(mean[1:], 1e-12), color=colour, label=label, lw=0.9)
    axes.set(xlabel="frequency / Hz", ylabel=f"amplitude / {unit}", xlim=(0.0, 0.25 / width))


def _orders(axes: Axes, fit: Fit, b: int, colour: str, label: str) -> None:
    """Draw the orders of the wheel in the residual of its tooth pattern."""
    output = fit.model.chain.blocks[b].outputs[0]
    teeth = fit.model.records[0].sensors[output].teeth
    turns: Floats = np.concatenate([r[:, 0] for r in fit.rest[b]]).reshape(-1, teeth)
    lines = 2.0 / teeth * np.abs(np.fft.rfft(turns.mean(axis=0)))
    orders = np.arange(1, lines.size)
    axes.semilogy(orders, np.maximum(lines[1:], 1e-12), color=colour, marker="o", ms=3, label=label)
    axes.set(xlabel=f"order of {output.split('_')[0]} wheel", ylabel="relative speed / 1")
