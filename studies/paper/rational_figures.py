"""Figures of rational functions with dead time: fit, profile likelihood, time-domain check.

figure = fit_figure(response, study, bandwidth=2 * np.pi * 10)
figure = delay_figure(study)
figure = time_figure(segments, bandwidth=2 * np.pi * 10)      # figure 7 of the paper
figure = order_figure(study)
"""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator

from slipbench.identification.models.delay_profile import DROP, DelayProfile
from slipbench.identification.models.rational_ml import RationalFit
from slipbench.identification.models.time_check import NoStretch, Stretch
from slipbench.identification.report import drawing as d
from slipbench.identification.report.words import gain_unit, name
from slipbench.identification.response.response import FrequencyResponse
from slipbench.protocol.recording.channel import FloatArray
from slipbench.studies.paper.rational_claims import RationalStudy, path_in_words

HZ = 2 * np.pi


def fit_figure(response: FrequencyResponse, study: RationalStudy, bandwidth: float) -> Figure:
    """Figure of gain and phase: estimate (markers), fits (lines), 95 % interval (band).

    bandwidth: w_c, rad/s, which normalises the frequency axis.
    """
    with d.style():
        figure, axes = d.panels(2, 5.8)
        fit = study.likely.best.fit
        lines, fine = study.lines, _fine(response)
        factor, unit = gain_unit(*response.si_units)
        x, at = HZ * fine / bandwidth, HZ * lines.frequency / bandwidth
        axes[0].plot(
            at,
            np.abs(lines.value) * factor,
            "o",
            ms=4,
            color=d.INK,
            label=f"{name(response.input)} to {name(response.output)}",
        )
        axes[1].plot(at, _degrees(lines.value), "o", ms=4, color=d.INK)
        _likely(axes, fit, fine, x, factor)
        paper = study.with_delay.best_by_fpe.fit.model.response(fine)
        look = {"color": d.ORANGE, "ls": (0, (5, 3))}
        label = f"paper, delay {1e3 * study.delay:.0f} ms held"
        axes[0].plot(x, np.abs(paper) * factor, label=label, **look)  # type: ignore[arg-type]
        axes[1].plot(x, _degrees(paper), **look)  # type: ignore[arg-type]
        axes[0].set(xscale="log", yscale="log", ylabel=f"gain / ({unit})")
        axes[0].yaxis.set_major_locator(LogLocator(base=10, subs=(1, 1.5, 2, 3, 5, 7)))
        for way in (axes[0].yaxis, axes[1].xaxis):
            way.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
            way.set_minor_formatter(FuncFormatter(lambda *_: ""))
        axes[1].xaxis.set_major_locator(LogLocator(base=10, subs=(1, 2, 3.5, 5, 7, 9)))
        axes[1].set(xscale="log", ylabel="phase / °", xlabel="ω / ω_c")
        d.legend(axes[0], 3)
    return figure


def delay_figure(study: RationalStudy) -> Figure:
    """Figure of the cost above its minimum, nats, over the dead time, for every plausible order."""
    with d.style():
        figure, axes = d.side_by_side(2, 3.6)
        titles = ("no prior knowledge", path_in_words(study.known) or "no prior knowledge")
        for panel, profile, title in zip(
            axes, (study.plain_profile, study.profile), titles, strict=True
        ):
            panel.set_title(title)
            panel.set(xlabel="dead time / ms", ylabel="cost above minimum / nats", ylim=(-0.2, 12))
            if isinstance(profile, DelayProfile):
                _profile(panel, profile)
                panel.axvline(1e3 * study.delay, color=d.GREEN, lw=1, label="true")
                panel.legend(loc="upper left")
            else:
                panel.text(0.5, 0.5, profile.reason, ha="center", wrap=True)
    return figure


def time_figure(segments: tuple[Stretch | NoStretch, ...], bandwidth: float) -> Figure:
    """Figure of measured and simulated slip about each frequency of the sweep (figure 7)."""
    with d.style():
        figure, axes = d.side_by_side(len(segments), 3.2)
        for panel, s in zip(axes, segments, strict=True):
            panel.set_title(f"{HZ * s.frequency / bandwidth:.2f} ω_c")
            panel.set(xlabel="time / s", ylabel="slip / %")
            if isinstance(s, NoStretch):
                panel.text(0.5, 0.5, s.reason, ha="center", transform=panel.transAxes, wrap=True)
                continue
            panel.plot(s.time, 100 * s.measured, color=d.INK, lw=1, label="measured")
            panel.plot(s.time, 100 * s.simulated, color=d.ORANGE, label="model")
            panel.set_title(f"{HZ * s.frequency / bandwidth:.2f} ω_c, fit {s.fit:.0f} %")
        if axes[0].lines:
            low, high = axes[0].get_ylim()
            axes[0].set_ylim(low, high + 0.2 * (high - low))  # room for the legend
            axes[0].legend(loc="upper right", ncols=2)
    return figure


def order_figure(study: RationalStudy) -> Figure:
    """Figure of AIC, MDL and FPE of every order above their minimum, and the limit of 2 nats."""
    with d.style():
        figure, axes = d.panels(1, 3.4)
        rows = sorted(study.likely.rows, key=lambda row: row.order)
        x = np.arange(len(rows))
        aic = np.array([row.nats for row in rows])
        mdl = np.array([row.criteria.mdl for row in rows]) / 2
        fpe = np.array([row.criteria.fpe for row in rows])
        fpe = np.log(fpe / fpe.min()) * study.lines.frequency.size
        look = ((aic, "AIC", d.BLUE), (mdl - mdl.min(), "MDL", d.ORANGE), (fpe, "FPE", d.GREEN))
        for value, label, colour in look:
            axes[0].plot(x, value, "o-", ms=4, lw=0.8, color=colour, label=label)
        axes[0].axhspan(0, 2, color=d.SHADE, lw=0)
        labels = [f"{row.order.zeros}/{row.order.poles}" for row in rows]
        axes[0].set_xticks(x, labels, rotation=90 if len(rows) > 12 else 0)
        axes[0].set(
            ylim=(-0.5, 15), ylabel="criterion above minimum / nats", xlabel="zeros / poles"
        )
        d.legend(axes[0], 3)
    return figure


def _likely(axes: list[Axes], fit: RationalFit, f: FloatArray, x: FloatArray, k: float) -> None:
    value = fit.model.response(f)
    gain, band = np.abs(value), fit.band(f)
    label = f"maximum likelihood, {fit.order}, {1e3 * fit.model.delay:.1f} ms"
    axes[0].plot(x, k * gain, color=d.BLUE, label=label)
    low, high = k * np.maximum(gain - band, 0.1 * gain), k * (gain + band)
    axes[0].fill_between(x, low, high, color=d.BLUE, alpha=0.2, lw=0)
    phase, half = _degrees(value), np.degrees(fit.phase_band(f))
    axes[1].plot(x, phase, color=d.BLUE)
    axes[1].fill_between(x, phase - half, phase + half, color=d.BLUE, alpha=0.2, lw=0)


def _profile(panel: Axes, profile: DelayProfile) -> None:
    x = 1e3 * profile.grid
    least = min(float(np.min(p.cost / 2 + p.penalty)) for p in profile.profiles)
    colours = (d.BLUE, d.ORANGE, d.VIOLET, d.RED, d.MUTED)
    for p, colour in zip(profile.profiles, colours, strict=False):
        panel.plot(x, p.cost / 2 + p.penalty - least, color=colour, label=str(p.order))
    panel.axvspan(1e3 * profile.low, 1e3 * profile.high, color=d.SHADE, lw=0)
    panel.axhline(DROP, color=d.MUTED, lw=0.8, ls=(0, (4, 3)))


def _fine(response: FrequencyResponse) -> FloatArray:
    f = response.frequency[response.reliable]
    return np.geomspace(f[0], f[-1], 300)


def _degrees(value: "np.ndarray[tuple[int], np.dtype[np.complex128]]") -> FloatArray:
    return np.asarray(np.degrees(np.unwrap(np.angle(value))))
