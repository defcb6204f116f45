"""Report of a model that was fitted to columns of tables: response, model, held-out runs."""

from importlib.resources import files
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from slipbench.identification.models.held_out import HeldOut
from slipbench.identification.models.rational_ml import ACROSS
from slipbench.identification.models.table_study import TableStudy
from slipbench.identification.report import drawing as d

POINTS = 400
SHOWN = 6  # runs in a figure
HEAD = ("run", "role", "NRMSE fit", "rms error")


def page(of: TableStudy) -> str:
    """Report as HTML text."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    here = files("slipbench.identification.report")
    template = environment.from_string((here / "table_report.html").read_text(encoding="utf-8"))
    with d.style():
        drawn = [("Frequency response and model", RESPONSE, response_figure(of))]
        if of.unseen:
            drawn.append(("Held-out runs", HELD_OUT, runs_figure(of, of.unseen)))
        drawn.append(("Training runs", TRAINED, runs_figure(of, of.trained[:2])))
    return template.render(
        title=f"{of.names[0]} to {of.names[1]}",
        style=Markup((here / "report.css").read_text(encoding="utf-8")),
        headline=headline(of),
        figures=[(name, text, Markup(d.svg(f, name))) for name, text, f in drawn],
        model=model_rows(of),
        head=HEAD,
        rows=rows(of),
    )


def headline(of: TableStudy) -> str:
    """Key result in a sentence."""
    fits = [one.fit for one in of.unseen]
    if fits:
        span = f"{min(fits):.0f} to {max(fits):.0f} %"
        end = f"NRMSE fit on {len(fits)} held-out runs: {span}"
    else:
        end = "no run was held out, so the model is not validated"
    return (
        f"Model from {of.names[0]} to {of.names[1]}: {of.found.fit.order}, dead time "
        f"{1e3 * of.found.model.delay:.1f} ms, valid from {of.band[0]:.2g} to {of.band[1]:.3g} Hz; "
        f"{end}."
    )


def model_rows(of: TableStudy) -> list[tuple[str, str]]:
    """Rows of the model: order, dead time, poles, zeros, residual; with 95 % intervals."""
    fit, model = of.found.fit, of.found.model
    near = [str(row.order) for row in of.found.choice.within() if row.order != fit.order]
    spread = ACROSS * float(np.sqrt(fit.covariance[0, 0])) / fit.pace
    made = [
        (
            "Order",
            f"{fit.order}, selected by MDL with {of.found.independent} independent samples; "
            f"also plausible (AIC difference below 4): {'; '.join(near) or 'no other order'}",
        ),
        ("Dead time", f"{1e3 * model.delay:.1f} ± {1e3 * spread:.1f} ms for this order"),
    ]
    made += [("Poles", "; ".join(_roots(model.poles)))]
    if model.zeros.size:
        made.append(("Zeros", "; ".join(_roots(model.zeros))))
    if of.response is not None:
        made.append(("Frequency response", of.response.method))
    return [*made, ("Residual", f"{fit.error:.3g} rms"), ("Notes", " ".join(of.words))]


def rows(of: TableStudy) -> list[tuple[str, str, str, str]]:
    """Rows of run, role, NRMSE fit and rms error; held-out runs first."""
    return [
        (one.name, role, f"{one.fit:.1f} %", f"{one.error:.3g}")
        for role, several in (("held-out", of.unseen), ("training", of.trained))
        for one in several
    ]


def response_figure(of: TableStudy) -> Figure:
    """Bode plot of the measured response and the model, with the coherence."""
    figure, axes = d.panels(3, 6.4, [3, 2, 1.3])
    f = np.geomspace(of.band[0], of.band[1], POINTS)
    value = of.found.model.response(f)
    phase = np.degrees(np.unwrap(np.angle(value)))
    axes[0].plot(f, np.abs(value), color=d.BLUE, label="model")
    axes[1].plot(f, phase, color=d.BLUE)
    if of.response is not None:
        lines, band = of.response, of.response.gain_band
        axes[0].errorbar(
            lines.frequency,
            lines.gain,
            band,
            fmt="o",
            ms=3,
            lw=0.9,
            color=d.ORANGE,
            label="measured, 95 % interval",
        )
        near = np.degrees(np.angle(lines.value / of.found.model.response(lines.frequency)))
        at = np.interp(lines.frequency, f, phase) + near
        half = np.degrees(lines.phase_band)
        axes[1].errorbar(lines.frequency, at, half, fmt="o", ms=3, lw=0.9, color=d.ORANGE)
        axes[2].plot(lines.frequency, lines.coherence, color=d.ORANGE)
    axes[0].set(xscale="log", yscale="log", ylabel=f"{of.names[1]} per {of.names[0]}")
    axes[1].set(ylabel="phase / °")
    axes[2].set(ylabel="coherence", ylim=(0, 1.05), xlabel="frequency / Hz")
    d.plain_decades(axes[0], axes[2])
    d.legend(axes[0], 2)
    return figure


def runs_figure(of: TableStudy, several: tuple[HeldOut, ...]) -> Figure:
    """Figure of measured and predicted output of runs."""
    shown = several[:SHOWN]
    figure, axes = d.panels(len(shown), 1.0 + 1.5 * len(shown))
    for panel, one in zip(axes, shown, strict=True):
        d.line(panel, one.time, one.measured, color=d.MUTED, label="measured")
        d.line(panel, one.time, one.predicted, color=d.RED, lw=1.0, label="predicted")
        panel.set(title=f"{one.name}: NRMSE fit {one.fit:.0f} %", ylabel=of.names[1])
    axes[-1].set_xlabel("time / s")
    d.legend(axes[0], 2)
    return figure


def figures(of: TableStudy) -> dict[str, Any]:
    """Contents of model.json; units as in the tables, frequencies in Hz, times in s."""
    model, fit = of.found.model, of.found.fit
    return {
        "input": of.names[0],
        "output": of.names[1],
        "band": list(of.band),
        "poles": [[p.real, p.imag] for p in model.poles],
        "zeros": [[z.real, z.imag] for z in model.zeros],
        "gain": model.gain,
        "delay": model.delay,
        "error": fit.error,
        "noise": of.noise,
        "order": {"poles": fit.order.poles, "zeros": fit.order.zeros},
        "runs": [
            {"name": one.name, "unseen": unseen, "fit": one.fit, "error": one.error}
            for unseen, several in ((True, of.unseen), (False, of.trained))
            for one in several
        ],
        "words": list(of.words),
    }


def _roots(roots: np.ndarray) -> list[str]:
    """Roots as text: frequency, damping ratio and half plane."""
    texts = []
    for root in sorted((r for r in roots if r.imag >= 0), key=abs):
        side = ", right half plane" if root.real > 0 else ""
        frequency = f"{abs(root) / (2 * np.pi):.3g} Hz"
        damping = (
            f", damping ratio {abs(root.real) / abs(root):.3f}" if root.imag > 0 else " (real)"
        )
        texts.append(frequency + damping + side)
    return texts


RESPONSE = (
    "Points: mean output spectrum over input spectrum; bars: 95 % interval from the variation between "
    "runs."
)
HELD_OUT = "Simulated from the input alone."
TRAINED = "Two of the training runs."
