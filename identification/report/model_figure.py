"""Figures of the fitted model and of the higher harmonics."""

import numpy as np
from matplotlib.figure import Figure

from slipbench.identification.models.recommended import Recommended
from slipbench.identification.report import drawing as d
from slipbench.identification.report.words import gain_axis, name, response_unit
from slipbench.identification.response.describing_function import DescribingFunction
from slipbench.identification.response.response import reliable_band

POINTS = 300
KNOWN = 1.0  # largest ratio of 95 % half width to value; wider ones are faded


def model_figure(found: tuple[Recommended, ...]) -> Figure | None:
    """Bode plot of models with 95 % intervals and of the bins they were fitted to; None without."""
    if not found:
        return None
    figure, axes = d.panels(2, 5.2, [3, 2])
    factor, unit = response_unit(found[0].response)
    for one, colour in zip(found, (d.BLUE, d.ORANGE, d.GREEN), strict=False):
        lines, fit = one.fit.lines, one.fit
        low, high = reliable_band(one.response) or (lines.frequency[0], lines.frequency[-1])
        f = np.geomspace(low, high, POINTS)
        value, band = fit.response(f), fit.band(f)
        gain = np.abs(value)
        look = {"color": colour, "alpha": 0.25, "lw": 0}
        axes[0].fill_between(f, factor * (gain - band), factor * (gain + band), **look)  # type: ignore[arg-type]
        label = f"from {name(one.response.input)}: {fit.order}"
        axes[0].plot(f, factor * gain, color=colour, label=label)
        axes[0].plot(lines.frequency, factor * np.abs(lines.value), "o", ms=3.5, color=colour)
        phase = np.degrees(np.unwrap(np.angle(value)))
        half = np.degrees(fit.phase_band(f))
        axes[1].fill_between(f, phase - half, phase + half, **look)  # type: ignore[arg-type]
        axes[1].plot(f, phase, color=colour)
        near = np.degrees(np.angle(lines.value / fit.response(lines.frequency)))
        axes[1].plot(
            lines.frequency, np.interp(lines.frequency, f, phase) + near, "o", ms=3.5, color=colour
        )
    axes[0].set(xscale="log", yscale="log", ylabel=gain_axis(unit))
    axes[1].set(ylabel="phase / °", xlabel="frequency / Hz")
    d.plain_decades(axes[0], axes[1])
    d.legend(axes[0], 2)
    return figure


def harmonics_figure(found: DescribingFunction | None) -> Figure | None:
    """Figure of second and third harmonic over the first, %, with 95 % intervals; None without."""
    if found is None:
        return None
    figure, axes = d.panels(1, 2.9)
    first = found.gain[0]
    for k, colour in zip(range(1, len(found.value)), (d.ORANGE, d.GREEN), strict=False):
        share, band = 100 * found.gain[k] / first, 100 * found.gain_band[k] / first
        known = np.where(band <= KNOWN * share, share, np.nan)
        axes[0].fill_between(
            found.frequency,
            np.maximum(share - band, 0),
            share + band,
            color=colour,
            alpha=0.2,
            lw=0,
        )
        axes[0].plot(found.frequency, share, color=colour, alpha=0.3, lw=0.8)
        axes[0].plot(found.frequency, known, color=colour, label=("second", "third")[k - 1])
    axes[0].set(
        xlabel="excitation frequency / Hz", ylabel="relative to first harmonic / %", ylim=(0, None)
    )
    d.legend(axes[0], 2)
    return figure
