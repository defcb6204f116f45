"""The figure that convinces: held-out residuals of one output, re-calibrated and improved.

In time where the two systems differ most, as spectra with the band in which they differ, and along
the regressor: what the re-calibrated simulation leaves, with the change that the effect brings
there. That change is simulated, not fitted to these residuals: where the points of the re-calibrated
file lie on its curve and those of the improved file on zero, the effect explains them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.reporting.improvement import OutputImprovement, within
from slipbench.identification.mismatch.reporting.over_regressor import edges_of, followed, means
from slipbench.identification.mismatch.simulation.regressor import quantity_of
from slipbench.identification.mismatch.simulation.written_units import SI, WrittenUnits
from slipbench.identification.report import drawing as d
from slipbench.plant.signals import Floats

LOOKS = ((d.ORANGE, "re-calibrated"), (d.BLUE, "improved"))
WINDOW = 2.0
"""Seconds of the first panel."""


@dataclass(frozen=True, eq=False)
class Residuals:
    """Residuals of one output on the held-out recordings, in the units of the file.

    before, after: (T,) by record.
    """

    runs: tuple[Fit, Fit]
    shown: OutputImprovement
    before: list[Floats]
    after: list[Floats]
    unit: str

    @classmethod
    def of(
        cls, runs: Sequence[Fit], shown: OutputImprovement, written: WrittenUnits = SI
    ) -> "Residuals":
        """Take the residuals of an output. runs: re-calibrated and improved."""
        blocks = runs[0].model.partition.groups
        b = next(i for i, k in enumerate(blocks) if shown.output in k.outputs)
        j = blocks[b].outputs.index(shown.output)
        factor, unit = written.factor(shown.unit, shown.output.replace("_", " "))
        before, after = ([factor * r[:, j] for r in run.residuals[b]] for run in runs)
        return cls((runs[0], runs[1]), shown, before, after, unit)

    @property
    def width(self) -> float:
        """Seconds of a bin."""
        return self.runs[0].model.records[0].grid.width

    @property
    def both(self) -> tuple[list[Floats], list[Floats]]:
        """Residuals of both systems."""
        return self.before, self.after

    def in_band(self, series: Sequence[Floats]) -> list[Floats]:
        """Return series in the band in which the systems differ."""
        return [within(one, self.shown.band, self.width) for one in series]

    @property
    def change(self) -> list[Floats]:
        """Change of the output that the effect brings, as simulated."""
        return [x - y for x, y in zip(self.before, self.after, strict=True)]


def evidence_svg(found: Residuals, regressor: str, written: WrittenUnits = SI) -> str:
    """Draw the residuals before and after. regressor: of the effect; empty: none tells it."""
    pattern = found.shown.band is None
    with d.style():
        figure, panels = d.side_by_side(2 if pattern else 3, 3.2)
        if pattern:
            _turn(panels[0], found)
            _orders(panels[1], found)
        else:
            _time(panels[0], found)
            _spectra(panels[1], found)
            _along(panels[2], found, regressor, written)
        d.legend(panels[0], 2)
        return d.svg(figure, "held_out")


def _time(axes: Axes, found: Residuals) -> None:
    """Draw the part of the recordings in which the two systems differ most."""
    count = min(round(WINDOW / found.width), *(c.size for c in found.change))
    energy = [np.convolve(c**2, np.ones(count), "valid") for c in found.change]
    r = int(np.argmax([e.max() for e in energy]))
    first = int(np.argmax(energy[r]))
    record = found.runs[0].model.records[r]
    time = record.grid.centre[first : first + count]
    for series, (colour, label) in zip(found.both, LOOKS, strict=True):
        y = series[r][first : first + count]
        d.line(axes, time[: y.size], y, color=colour, label=label, lw=0.9)
    axes.set(xlabel=f"time / s, {record.name}", ylabel=f"measured minus simulated / {found.unit}")


def _spectra(axes: Axes, found: Residuals) -> None:
    """Draw mean spectra over all recordings, as long as the shortest, and the band."""
    length = min(len(r) for r in found.before)
    window = np.hanning(length)
    grid = np.fft.rfftfreq(length, found.width)
    if found.shown.band:
        axes.axvspan(*found.shown.band, color=d.SHADE, lw=0)
    for series, (colour, label) in zip(found.both, LOOKS, strict=True):
        lines = np.abs(np.fft.rfft([r[:length] * window for r in series], axis=1))
        mean = np.sqrt(np.mean(lines**2, axis=0)) * 2.0 / window.sum()
        axes.semilogy(grid[1:], np.maximum(mean[1:], 1e-12), color=colour, label=label, lw=0.9)
    axes.set(xlabel="frequency / Hz", ylabel=f"amplitude / {found.unit}")
    axes.set_xlim(
        0.0, max(0.25 / found.width, 1.2 * found.shown.band[1] if found.shown.band else 0)
    )


def _along(axes: Axes, found: Residuals, regressor: str, written: WrittenUnits) -> None:
    """Draw means of the residuals, in the band, over the regressor, and the simulated change."""
    change = found.in_band(found.change)
    x, lag = followed(found.runs[1], regressor, change)
    factor, unit = written.factor(_si_unit(found, regressor), quantity_of(regressor))
    if not x:
        x, factor, unit = change, 1.0, found.unit
    edges = edges_of(x)
    axes.axhline(0.0, color=d.MUTED, lw=0.8)
    centre, curve, _ = means(x, change, edges)
    axes.plot(factor * centre, curve, color=d.INK, lw=1.2, label="change by the effect, simulated")
    for series, (colour, label) in zip(found.both, LOOKS, strict=True):
        centre, mean, half = means(x, found.in_band(series), edges)
        look = {"color": colour, "label": label, "fmt": "o", "ms": 3.5, "lw": 1.0}
        axes.errorbar(factor * centre, mean, half, **look)  # type: ignore[arg-type]
    quantity = quantity_of(regressor) if x is not change else "simulated change of the output"
    late = f", {1e3 * lag:.0f} ms before" if lag else ""
    axes.set(
        xlabel=f"{quantity}{late} / {unit}", ylabel=f"mean residual in the band / {found.unit}"
    )


def _si_unit(found: Residuals, regressor: str) -> str:
    return found.runs[0].model.system.units.get(quantity_of(regressor), "")


def _turns(found: Residuals) -> list[Floats]:
    """Residual of every tooth over one turn, re-calibrated and improved."""
    teeth = found.runs[0].model.records[0].sensors[found.shown.output].teeth
    return [np.concatenate(series).reshape(-1, teeth).mean(axis=0) for series in found.both]


def _turn(axes: Axes, found: Residuals) -> None:
    for pattern, (colour, label) in zip(_turns(found), LOOKS, strict=True):
        angle = 2.0 * np.pi * np.arange(pattern.size) / pattern.size
        axes.plot(angle, pattern, color=colour, marker="o", ms=3, label=label)
    wheel = found.shown.output.split("_")[0]
    axes.set(xlabel=f"angle of {wheel} wheel / rad", ylabel="relative speed, residual / 1")


def _orders(axes: Axes, found: Residuals) -> None:
    for pattern, (colour, label) in zip(_turns(found), LOOKS, strict=True):
        lines = 2.0 / pattern.size * np.abs(np.fft.rfft(pattern))
        orders = np.arange(1, lines.size)
        axes.semilogy(
            orders, np.maximum(lines[1:], 1e-12), color=colour, marker="o", ms=3, label=label
        )
    axes.set(xlabel=f"order of {found.shown.output.split('_')[0]} wheel", ylabel="relative speed")
