"""Describing functions and best linear approximations, drawn.

figure = describing_figure(harmonics(runs), sliced(runs))     # figures 6 and 10 of the paper
figure = linear_figure(best_linear(records))
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slipbench.identification.report import drawing as d
from slipbench.identification.report.words import gain_unit, name
from slipbench.identification.response.best_linear import BestLinearApproximation
from slipbench.identification.response.describing_function import DescribingFunction
from slipbench.identification.signals.named import unit_of
from slipbench.protocol.recording.channel import FloatArray
from slipbench.studies.paper.harmonic_claims import CUTOFF, ZONES

COLOURS = (d.BLUE, d.ORANGE, d.GREEN)
MARKERS = ("o", "s", "^")
KNOWN = 1.0  # greatest band beside the gain at which a phase is drawn
DEEPEST = 60.0  # dB that the gain's panel shows


def describing_figure(
    found: DescribingFunction, points: DescribingFunction | None = None, cutoff: float = CUTOFF
) -> Figure:
    """Figure of gain, phase and ratio to the first harmonic over f / f_c.

    found: lines with their 95 % intervals; points: another estimate, as markers; cutoff: Hz.
    """
    with d.style():
        figure, axes = d.panels(3, 7.6, [3, 2, 2])
        factor, unit = gain_unit(unit_of(found.input), unit_of(found.output))
        for k in range(min(len(found.value), len(COLOURS))):
            _lines(axes, found, k, factor, cutoff)
            if points is not None:
                _markers(axes, points, k, factor, cutoff)
        top = 20 * np.log10(factor * found.gain[0].max())
        axes[0].set(ylabel=f"gain / dB ({unit})", ylim=(top - DEEPEST, top + 5))
        axes[1].set(ylabel="phase / °", ylim=(-200, 200), yticks=(-180, -90, 0, 90, 180))
        axes[2].set(ylabel="ratio to first harmonic / %", ylim=(0, None))
        axes[2].set_xlabel(f"excitation frequency / f_c (f_c = {cutoff:g} Hz)")
        for panel in axes:
            _zones(panel)
        axes[0].set_title(f"{name(found.input)} to {name(found.output)}", loc="left")
        d.legend(axes[0], 6)
    return figure


def linear_figure(found: BestLinearApproximation, cutoff: float = CUTOFF) -> Figure:
    """Figure of the best linear approximation, noise, even and odd distortion. cutoff: Hz."""
    with d.style():
        figure, axes = d.panels(2, 6.0, [3, 2])
        factor, unit = gain_unit(unit_of(found.input), unit_of(found.output))
        x, gain = found.frequency / cutoff, np.abs(found.value)
        axes[0].plot(x, _decibel(factor * gain), "o-", ms=3, color=d.BLUE, label="best linear")
        for level, colour, mark, label in (
            (found.even, d.ORANGE, "s", "even distortion"),
            (found.odd, d.GREEN, "^", "odd"),
        ):
            at = level.frequency / cutoff
            axes[0].plot(at, _decibel(factor * level.level), mark, ms=3, color=colour, label=label)
        axes[0].plot(x, _decibel(factor * found.total_deviation), color=d.RED, label="total")
        axes[0].plot(x, _decibel(factor * found.noise_deviation), color=d.MUTED, label="noise")
        axes[1].plot(x, _unbroken(found.value), "o-", ms=3, color=d.BLUE)
        top = 20 * np.log10(factor * gain.max())
        axes[0].set(ylabel=f"dB ({unit})", ylim=(top - DEEPEST, top + 5))
        axes[1].set(ylabel="phase / °", ylim=(-200, 200), yticks=(-180, -90, 0, 90, 180))
        axes[1].set_xlabel(f"f / f_c (f_c = {cutoff:g} Hz)")
        axes[0].set_title(f"{name(found.input)} to {name(found.output)}")
        d.legend(axes[0], 5)
    return figure


def _lines(
    axes: list[Axes], found: DescribingFunction, k: int, factor: float, cutoff: float
) -> None:
    x, gain, band = found.frequency / cutoff, found.gain[k], found.gain_band[k]
    look = {"color": COLOURS[k], "alpha": 0.18, "lw": 0}
    low, high = (np.maximum(gain + s * band, 1e-3 * gain) for s in (-1, 1))
    axes[0].fill_between(x, _decibel(factor * low), _decibel(factor * high), **look)  # type: ignore[arg-type]
    axes[0].plot(x, _decibel(factor * gain), color=COLOURS[k], label=f"G{k + 1}")
    known = band < KNOWN * gain
    axes[1].plot(x, _unbroken(np.where(known, found.value[k], np.nan)), color=COLOURS[k])
    if k:
        first = found.gain[0]
        axes[2].fill_between(
            x,
            100 * np.maximum(gain - band, 0) / first,
            100 * (gain + band) / first,
            **look,  # type: ignore[arg-type]
        )
        axes[2].plot(x, 100 * gain / first, color=COLOURS[k])


def _markers(
    axes: list[Axes], points: DescribingFunction, k: int, factor: float, cutoff: float
) -> None:
    x, gain = points.frequency / cutoff, points.gain[k]
    look = {"color": COLOURS[k], "ms": 3, "ls": "none", "alpha": 0.7, "mew": 0}
    axes[0].plot(x, _decibel(factor * gain), MARKERS[k], label=f"G{k + 1}, slices", **look)  # type: ignore[arg-type]
    known = points.gain_band[k] < KNOWN * gain
    phase = np.degrees(np.angle(points.value[k]))
    axes[1].plot(x[known], phase[known], MARKERS[k], **look)  # type: ignore[arg-type]
    if k:
        axes[2].plot(x, 100 * gain / points.gain[0], MARKERS[k], **look)  # type: ignore[arg-type]


def _decibel(gain: FloatArray) -> FloatArray:
    return 20 * np.log10(np.maximum(gain, 1e-300))


def _unbroken(value: np.ndarray) -> FloatArray:
    """Phase within a turn, degrees, with a gap where it wraps."""
    phase = np.degrees(np.angle(value))
    wraps = np.abs(np.diff(phase, prepend=phase[0])) > 180
    return np.where(wraps, np.nan, phase)


def _zones(panel: Axes) -> None:
    for edge in ZONES:
        panel.axvline(edge, color=d.MUTED, lw=0.9, ls=(0, (4, 3)))
