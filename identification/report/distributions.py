"""Histogram of slip and amplitude spectra of speeds."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from slipbench.identification.report import drawing as d
from slipbench.identification.report.words import name, shown, unit
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.motion import Motion
from slipbench.identification.signals.spectrum import LOWEST
from slipbench.protocol.recording.channel import FloatArray

MOST = 200.0  # Hz, upper end of the frequency axis


def slip_statistics(found: Identification) -> Figure | None:
    """Figure of the slip histogram and of slip over speed; None without slip."""
    if not isinstance(found.motion, Motion) or found.motion.slip.kind != "slip":
        return None
    ratio, speed = found.motion.slip.ratio, found.motion.reference
    known = np.isfinite(ratio)
    low, high = np.percentile(ratio[known] * 100, (0.2, 99.8))
    figure, (left, right) = d.side_by_side(2, 3.0)
    left.hist(np.clip(ratio[known] * 100, low, high), bins=80, color=d.BLUE)
    left.set(xlabel="slip / %", ylabel="samples", title="Histogram")
    right.hexbin(
        shown(speed[known], "m/s"),
        np.clip(ratio[known] * 100, low, high),
        gridsize=55,
        bins="log",
        cmap="Blues",
        mincnt=1,
        linewidths=0.1,
        rasterized=True,
    )
    right.set(xlabel="speed / km/h", ylabel="slip / %", title="Slip over speed")
    return figure


def spectra(found: Identification) -> Figure | None:
    """Figure of the amplitude spectra of wheel, engine and suspension; wheel orders marked."""
    if not found.spectra:
        return None
    figure, axes = d.panels(len(found.spectra), 1.0 + 1.8 * len(found.spectra))
    for panel, item in zip(axes, found.spectra, strict=True):
        amplitude = np.maximum(shown(item.amplitude, item.unit), 1e-12)
        inside = item.frequency > LOWEST
        panel.semilogy(item.frequency[inside], amplitude[inside], color=d.BLUE, lw=1.1)
        panel.set_title(name(item.role))
        panel.set_ylabel(f"amplitude / {unit(item.unit)}")
        low, high = np.percentile(amplitude[inside], 2), amplitude[inside].max()
        panel.set_ylim(low / 2, high * (high / low) ** 0.22)
        _mark_orders(panel, item.orders, item.width)
    axes[-1].set_xlabel("frequency / Hz")
    top = min(max(float(item.frequency[-1]) for item in found.spectra), MOST)
    axes[-1].set_xlim(0, top)
    return figure


def _mark_orders(axes: Axes, orders: FloatArray, width: float) -> None:
    for index, frequency in enumerate(orders[:8], start=1):
        half = max(width * index / 2, 0.1)
        axes.axvspan(frequency - half, frequency + half, color=d.ORANGE, alpha=0.18, lw=0)
        axes.text(
            frequency,
            0.97,
            f"{index}X",
            transform=axes.get_xaxis_transform(),
            va="top",
            ha="center",
            clip_on=True,
            fontsize=8.5,
            color=d.ORANGE,
            fontweight="bold",
        )
