"""Figure of the held-out residuals of one output, of the re-calibrated and the improved system.

Panels: the time series where the two systems differ most; the spectra, with the band in which they
differ; the mean residual over the regressor, with the change of the output by the effect. This
change is simulated, not fitted to the residuals: the effect explains the residuals where those of
the re-calibrated system lie on the curve of the change, and those of the improved system on zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.reporting.improvement import OutputImprovement, within
from slipbench.identification.mismatch.reporting.over_regressor import (
    delayed_regressor,
    edges_of,
    means,
)
from slipbench.identification.mismatch.simulation.regressor import quantity_of
from slipbench.identification.mismatch.simulation.written_units import SI, WrittenUnits
from slipbench.identification.report import drawing as d
from slipbench.plant.signals import Floats

LOOKS = ((d.ORANGE, "re-calibrated"), (d.BLUE, "improved"))
WINDOW = 2.0
"""Duration shown in the first panel, s."""


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
        """Return the residuals of an output. runs: re-calibrated and improved."""
        groups = runs[0].model.partition.groups
        group_number = next(i for i, k in enumerate(groups) if shown.output in k.outputs)
        column = groups[group_number].outputs.index(shown.output)
        factor, unit = written.factor(shown.unit, shown.output.replace("_", " "))
        before, after = (
            [factor * r[:, column] for r in run.residuals[group_number]] for run in runs
        )
        return cls((runs[0], runs[1]), shown, before, after, unit)

    @property
    def width(self) -> float:
        """Bin width, s."""
        return self.runs[0].model.records[0].grid.width

    @property
    def both(self) -> tuple[list[Floats], list[Floats]]:
        """Residuals of both systems, (T,) by record, in the units of the file."""
        return self.before, self.after

    def in_band(self, series: Sequence[Floats]) -> list[Floats]:
        """Return series, (T,) by record, in the band in which the systems differ."""
        return [within(residual, self.shown.band, self.width) for residual in series]

    @property
    def change(self) -> list[Floats]:
        """Simulated change of the output by the effect, (T,) by record, in units of the file."""
        return [before - after for before, after in zip(self.before, self.after, strict=True)]


def evidence_svg(residuals: Residuals, regressor: str, written: WrittenUnits = SI) -> str:
    """Draw the residuals before and after. regressor: of the effect; empty: unknown."""
    is_tooth_pattern = residuals.shown.band is None
    with d.style():
        figure, panels = d.side_by_side(2 if is_tooth_pattern else 3, 3.2)
        if is_tooth_pattern:
            _plot_tooth_pattern(panels[0], residuals)
            _plot_orders(panels[1], residuals)
        else:
            _plot_time(panels[0], residuals)
            _plot_spectra(panels[1], residuals)
            _plot_over_regressor(panels[2], residuals, regressor, written)
        d.legend(panels[0], 2)
        return d.svg(figure, "held_out")


def _plot_time(axes: Axes, residuals: Residuals) -> None:
    """Draw the segment of the recordings in which the two systems differ most."""
    count = min(round(WINDOW / residuals.width), *(change.size for change in residuals.change))
    energy = [np.convolve(change**2, np.ones(count), "valid") for change in residuals.change]
    record_number = int(np.argmax([window_energy.max() for window_energy in energy]))
    first = int(np.argmax(energy[record_number]))
    record = residuals.runs[0].model.records[record_number]
    time = record.grid.centre[first : first + count]
    for series, (colour, label) in zip(residuals.both, LOOKS, strict=True):
        segment = series[record_number][first : first + count]
        d.line(axes, time[: segment.size], segment, color=colour, label=label, lw=0.9)
    axes.set(
        xlabel=f"time / s, {record.name}", ylabel=f"measured minus simulated / {residuals.unit}"
    )


def _plot_spectra(axes: Axes, residuals: Residuals) -> None:
    """Draw the band and the mean spectra over all recordings, cut to the shortest."""
    length = min(len(r) for r in residuals.before)
    window = np.hanning(length)
    frequency = np.fft.rfftfreq(length, residuals.width)
    if residuals.shown.band:
        axes.axvspan(*residuals.shown.band, color=d.SHADE, lw=0)
    for series, (colour, label) in zip(residuals.both, LOOKS, strict=True):
        spectra = np.abs(np.fft.rfft([r[:length] * window for r in series], axis=1))
        mean = np.sqrt(np.mean(spectra**2, axis=0)) * 2.0 / window.sum()
        axes.semilogy(frequency[1:], np.maximum(mean[1:], 1e-12), color=colour, label=label, lw=0.9)
    axes.set(xlabel="frequency / Hz", ylabel=f"amplitude / {residuals.unit}")
    axes.set_xlim(
        0.0,
        max(0.25 / residuals.width, 1.2 * residuals.shown.band[1] if residuals.shown.band else 0),
    )


def _plot_over_regressor(
    axes: Axes, residuals: Residuals, regressor: str, written: WrittenUnits
) -> None:
    """Draw the mean residuals in the band over the regressor, and the simulated change."""
    change = residuals.in_band(residuals.change)
    x, lag = delayed_regressor(residuals.runs[1], regressor, change)
    factor, unit = written.factor(_si_unit(residuals, regressor), quantity_of(regressor))
    if not x:
        x, factor, unit = change, 1.0, residuals.unit
    edges = edges_of(x)
    axes.axhline(0.0, color=d.MUTED, lw=0.8)
    centre, curve, _ = means(x, change, edges)
    axes.plot(factor * centre, curve, color=d.INK, lw=1.2, label="change by the effect, simulated")
    for series, (colour, label) in zip(residuals.both, LOOKS, strict=True):
        centre, mean, half_width = means(x, residuals.in_band(series), edges)
        look = {"color": colour, "label": label, "fmt": "o", "ms": 3.5, "lw": 1.0}
        axes.errorbar(factor * centre, mean, half_width, **look)  # type: ignore[arg-type]
    quantity = quantity_of(regressor) if x is not change else "simulated change of the output"
    lag_text = f", {1e3 * lag:.0f} ms before" if lag else ""
    axes.set(
        xlabel=f"{quantity}{lag_text} / {unit}",
        ylabel=f"mean residual in the band / {residuals.unit}",
    )


def _si_unit(residuals: Residuals, regressor: str) -> str:
    return residuals.runs[0].model.system.units.get(quantity_of(regressor), "")


def _tooth_patterns(residuals: Residuals) -> list[Floats]:
    """Return the mean residual of every tooth of a turn, re-calibrated and improved, (teeth,)."""
    teeth = residuals.runs[0].model.records[0].sensors[residuals.shown.output].teeth
    return [np.concatenate(series).reshape(-1, teeth).mean(axis=0) for series in residuals.both]


def _plot_tooth_pattern(axes: Axes, residuals: Residuals) -> None:
    for pattern, (colour, label) in zip(_tooth_patterns(residuals), LOOKS, strict=True):
        angle = 2.0 * np.pi * np.arange(pattern.size) / pattern.size
        axes.plot(angle, pattern, color=colour, marker="o", ms=3, label=label)
    wheel = residuals.shown.output.split("_")[0]
    axes.set(xlabel=f"angle of {wheel} wheel / rad", ylabel="relative speed, residual / 1")


def _plot_orders(axes: Axes, residuals: Residuals) -> None:
    for pattern, (colour, label) in zip(_tooth_patterns(residuals), LOOKS, strict=True):
        amplitudes = 2.0 / pattern.size * np.abs(np.fft.rfft(pattern))
        orders = np.arange(1, amplitudes.size)
        axes.semilogy(
            orders, np.maximum(amplitudes[1:], 1e-12), color=colour, marker="o", ms=3, label=label
        )
    axes.set(
        xlabel=f"order of {residuals.shown.output.split('_')[0]} wheel", ylabel="relative speed"
    )
