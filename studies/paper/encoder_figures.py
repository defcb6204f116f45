"""Figures 1 and 2: error and delay of a toothed-wheel encoder, and its 1X order in spectra.

with drawing.style():
    drawing.png(encoder_figures.encoder(radius=0.32), path)
    drawing.png(encoder_figures.orders(found), path)
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from slipbench.identification.report import drawing as d
from slipbench.identification.report.words import name, shown, unit
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.spectrum import Spectrum
from slipbench.identification.signals.tooth_pitch import ToothPitch
from slipbench.studies.paper.encoder_study import LATE, SLOW, TEETH, encoder_curve, shown_wave

COLOURS = (d.BLUE, d.ORANGE, d.GREEN)
MEASURED = np.array([15.0, 25.0, 40.0, 70.0, 120.0]) / 3.6  # m/s
MOST = 60.0  # Hz
FAMILY = 8


def encoder(radius: float, fastest: float = 80.0) -> Figure:
    """Figure of error bound and delay over speed: lines from the formula, markers measured."""
    speed = np.linspace(2.0, fastest, 400)
    figure, (left, right) = d.side_by_side(2, 3.4)
    for teeth, colour in zip(TEETH, COLOURS, strict=True):
        curve = encoder_curve(speed, radius, teeth)
        read = [shown_wave(v, radius, teeth) for v in MEASURED]
        left.plot(3.6 * speed, 100 * curve.error, color=colour, label=f"{teeth} teeth")
        left.plot(3.6 * MEASURED, [100 * r.error for r in read], "o", color=colour, ms=4)
        right.semilogy(3.6 * speed, 1e3 * curve.delay, color=colour, label=f"{teeth} teeth")
        right.plot(3.6 * MEASURED, [1e3 * r.delay for r in read], "o", color=colour, ms=4)
    left.set(title="Error bound", xlabel="speed / km/h", ylabel="error / %")
    right.set(title="Delay", xlabel="speed / km/h", ylabel="delay / ms")
    right.axhline(1e3 * LATE, color=d.MUTED, lw=0.9, ls="--")
    right.axvline(3.6 * SLOW, color=d.MUTED, lw=0.9, ls="--")
    for axes in (left, right):
        axes.set_xlim(0, 3.6 * fastest)
    left.set_ylim(bottom=0)
    left.legend(loc="upper left")
    right.legend(loc="upper right")
    return figure


def orders(found: Identification) -> Figure | None:
    """Figure of the spectra of rear wheel, suspension and engine speed; 1X and harmonics marked."""
    made = sorted(found.spectra, key=lambda s: _PLACES.get(s.role, 1))
    if not made:
        return None
    figure, axes = d.panels(len(made), 0.9 + 1.75 * len(made))
    for panel, item in zip(axes, made, strict=True):
        _spectrum(panel, item)
    top = max(MOST, 3.3 * float(made[0].orders[0]) if made[0].orders.size else 0.0)
    axes[-1].set(xlabel="frequency / Hz", xlim=(0, top))
    return figure


_PLACES = {"rear_wheel_speed": 0, "rear_suspension_travel": 1, "engine_speed": 2}


def _spectrum(panel: Axes, item: Spectrum) -> None:
    inside = item.frequency > 0.3
    height = np.maximum(shown(item.amplitude[inside], item.unit), 1e-12)
    panel.semilogy(item.frequency[inside], height, color=d.BLUE, lw=1.1)
    panel.set(title=name(item.role).split(",")[0], ylabel=f"amplitude / {unit(item.unit)}")
    panel.set_ylim(np.percentile(height, 1) / 2, 6 * height.max())
    for index, frequency in enumerate(item.orders[:FAMILY], start=1):
        half = max(item.width * index / 2, 0.15)
        panel.axvspan(frequency - half, frequency + half, color=d.ORANGE, alpha=0.18, lw=0)
        panel.text(
            frequency,
            0.97,
            f"{index}X",
            transform=panel.get_xaxis_transform(),
            va="top",
            ha="center",
            clip_on=True,
            fontsize=8.5,
            color=d.ORANGE,
            fontweight="bold",
        )


def teeth(pitch: ToothPitch, radius: float | None = None) -> Figure:
    """Figure of position and pitch error of every tooth, 95 % intervals. radius: m, of the teeth."""
    scale, label = (180 / np.pi, "°") if radius is None else (1e3 * radius, "mm")
    figure, (left, right) = d.side_by_side(2, 3.0)
    number = np.arange(pitch.teeth)
    error = pitch.quantile * pitch.deviation
    at = pitch.positions - np.median(pitch.positions)
    left.stem(number, scale * at, linefmt=d.BLUE, markerfmt="o", basefmt=" ")
    left.set(title="Tooth position error", xlabel="tooth", ylabel=f"error / {label}")
    look = {"fmt": "o", "ms": 3.5, "color": d.BLUE, "ecolor": d.INK, "capsize": 2}
    right.errorbar(number, 100 * pitch.gaps, 100 * error, **look)  # type: ignore[arg-type]
    right.set_yscale("symlog", linthresh=max(200 * float(error.max()), 1e-6))
    right.set(title="Tooth pitch error", xlabel="tooth", ylabel="error of the next pitch / %")
    for axes in (left, right):
        axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    return figure
