"""Bode plot of frequency responses: gain, phase and coherence with 95 % intervals."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MultipleLocator

from slipbench.identification.report import drawing as d
from slipbench.identification.report.words import (
    decibel,
    decibel_axis,
    gain_axis,
    name,
    response_unit,
)
from slipbench.identification.response.resonance import NoResonance, Resonance
from slipbench.identification.response.response import RELIABLE_COHERENCE, FrequencyResponse
from slipbench.protocol.recording.channel import FloatArray


def bode(found: list[FrequencyResponse], peak: Resonance | NoResonance | None = None) -> Figure:
    """Bode plot of several responses; bins of low coherence or wide interval are faded."""
    figure, axes = d.panels(3, 6.6, [3, 3, 1.5], right=0.85)  # for the axis in dB
    factor, unit = response_unit(found[0])
    for response, colour in zip(found, (d.BLUE, d.ORANGE, d.GREEN), strict=False):
        _gain(axes[0], response, factor, colour)
        _phase(axes[1], response, colour)
        axes[2].plot(response.frequency, response.coherence, color=colour)
    if isinstance(peak, Resonance):
        _mark(axes[0], peak, factor)
    _format_axes(axes, found, unit)
    return figure


def _gain(axes: Axes, of: FrequencyResponse, factor: float, colour: str) -> None:
    gain, band = of.gain * factor, of.gain_band * factor
    label = f"from {name(of.input)} to {name(of.output)}"
    axes.fill_between(
        of.frequency,
        np.maximum(gain - band, gain * 0.1),
        gain + band,
        color=colour,
        alpha=0.18,
        lw=0,
    )
    axes.plot(of.frequency, _credible(of, gain), color=colour, label=label)
    axes.plot(of.frequency, gain, color=colour, alpha=0.3, lw=0.8)


def _phase(axes: Axes, of: FrequencyResponse, colour: str) -> None:
    phase, band = np.degrees(of.phase), np.degrees(of.phase_band)
    axes.fill_between(of.frequency, phase - band, phase + band, color=colour, alpha=0.18, lw=0)
    axes.plot(of.frequency, _credible(of, phase), color=colour)


def _credible(of: FrequencyResponse, value: FloatArray) -> FloatArray:
    return np.where(of.reliable, value, np.nan)


def _mark(axes: Axes, peak: Resonance, factor: float) -> None:
    top = peak.peak * peak.low_gain * factor
    axes.axhline(peak.low_gain * factor, color=d.MUTED, lw=0.9, ls=(0, (4, 3)))
    axes.plot([peak.frequency], [top], "o", color=d.RED, ms=6, zorder=5)
    axes.annotate(
        f"{peak.frequency:.2f} Hz, {decibel(peak.peak):+.1f} dB",
        (peak.frequency, top),
        xytext=(-8, 9),
        textcoords="offset points",
        color=d.RED,
        fontweight="bold",
        ha="right",
    )


def _phase_step(span: float) -> float:
    """Tick distance of the phase axis, degrees. span: of the phase, degrees."""
    return 15.0 if span < 90 else 45.0 if span < 360 else 90.0


def _decibels(gain: Axes, unit: str) -> None:
    """Second axis in dB: a logarithmic axis is linear in dB."""
    right = gain.twinx()
    low, high = gain.get_ylim()
    right.set(ylim=(20 * np.log10(low), 20 * np.log10(high)), ylabel=decibel_axis(unit))
    right.grid(visible=False)


def _format_axes(axes: list[Axes], found: list[FrequencyResponse], unit: str) -> None:
    reliable = [r.gain[r.reliable] for r in found if r.reliable.any()]
    factor = response_unit(found[0])[0]
    axes[0].set(xscale="log", yscale="log", ylabel=gain_axis(unit))
    if reliable:
        low, high = min(g.min() for g in reliable), max(g.max() for g in reliable)
        room = max(1.6, 2.5 * np.sqrt(low / high))
        axes[0].set_ylim(low * factor / room, high * factor * room)
    _decibels(axes[0], unit)
    d.legend(axes[0], 2)
    axes[1].set_ylabel("phase / °")
    phases = [np.degrees(r.phase[r.reliable]) for r in found if r.reliable.any()]
    if phases:
        low, high = min(p.min() for p in phases), max(p.max() for p in phases)
        axes[1].set_ylim(low - 25, high + 25)
        axes[1].yaxis.set_major_locator(MultipleLocator(_phase_step(high - low)))
    axes[2].axhline(RELIABLE_COHERENCE, color=d.MUTED, lw=0.9, ls=(0, (4, 3)))
    axes[2].set(ylabel="coherence", ylim=(0, 1.05), xlabel="frequency / Hz")
    d.plain_decades(axes[0], axes[2])
    axes[2].set_xlim(found[0].frequency[0], found[0].frequency[-1])
