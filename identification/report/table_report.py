"""The page about a model of columns: response, model, and what it predicts of runs unseen."""

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
SHOWN = 6  # runs that are drawn
HEAD = ("run", "role", "fit", "rms error")


def page(of: TableStudy) -> str:
    """Compose the page as HTML."""
    environment = jinja2.Environment(
        autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    here = files("slipbench.identification.report")
    template = environment.from_string((here / "table_report.html").read_text(encoding="utf-8"))
    with d.hand():
        drawn = [("Response and model", RESPONSE, response_figure(of))]
        if of.unseen:
            drawn.append(("Runs that the model has not seen", UNSEEN, runs_figure(of, of.unseen)))
        drawn.append(("Runs that it was fitted to", TRAINED, runs_figure(of, of.trained[:2])))
    return template.render(
        title=f"{of.names[0]} to {of.names[1]}",
        style=Markup((here / "report.css").read_text(encoding="utf-8")),
        headline=headline(of),
        figures=[(name, text, Markup(d.svg(f, name))) for name, text, f in drawn],
        model=told(of),
        head=HEAD,
        rows=rows(of),
    )


def headline(of: TableStudy) -> str:
    """Say the key result in a sentence."""
    fits = [one.fit for one in of.unseen]
    if fits:
        span = f"{min(fits):.0f} to {max(fits):.0f} %"
        end = f"it predicts {len(fits)} unseen runs with a fit of {span}"
    else:
        end = "no run was held out, so what it predicts is not known"
    return (
        f"From {of.names[0]} to {of.names[1]} a model with {of.found.fit.order} and a delay of "
        f"{1e3 * of.found.model.delay:.1f} ms describes {of.band[0]:.2g} to {of.band[1]:.3g} Hz; "
        f"{end}."
    )


def told(of: TableStudy) -> list[tuple[str, str]]:
    """Say what the model is, with 95 % intervals."""
    fit, model = of.found.fit, of.found.model
    near = [str(row.order) for row in of.found.choice.within() if row.order != fit.order]
    spread = ACROSS * float(np.sqrt(fit.covariance[0, 0])) / fit.pace
    made = [
        (
            "Order",
            f"{fit.order}, by description length of {of.found.independent} independent "
            f"samples; within two nats by AIC: {'; '.join(near) or 'no other'}",
        ),
        ("Delay", f"{1e3 * model.delay:.1f} ± {1e3 * spread:.1f} ms within this order"),
    ]
    made += [("Poles", "; ".join(_places(model.poles)))]
    if model.zeros.size:
        made.append(("Zeros", "; ".join(_places(model.zeros))))
    if of.response is not None:
        made.append(("Response", of.response.method))
    return [*made, ("Left by the fit", f"{fit.error:.3g} rms"), ("To know", " ".join(of.words))]


def rows(of: TableStudy) -> list[tuple[str, str, str, str]]:
    """List the errors of every run, the unseen first."""
    return [
        (one.name, role, f"{one.fit:.1f} %", f"{one.error:.3g}")
        for role, several in (("unseen", of.unseen), ("fitted", of.trained))
        for one in several
    ]


def response_figure(of: TableStudy) -> Figure:
    """Draw measured response and model over one another, and the coherence."""
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
            label="measured, 95 %",
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
    """Draw runs with what the model predicts of them."""
    shown = several[:SHOWN]
    figure, axes = d.panels(len(shown), 1.0 + 1.5 * len(shown))
    for panel, one in zip(axes, shown, strict=True):
        d.line(panel, one.time, one.measured, color=d.MUTED, label="measured")
        d.line(panel, one.time, one.predicted, color=d.RED, lw=1.0, label="predicted")
        panel.set(title=f"{one.name}: fit {one.fit:.0f} %", ylabel=of.names[1])
    axes[-1].set_xlabel("time / s")
    d.legend(axes[0], 2)
    return figure


def figures(of: TableStudy) -> dict[str, Any]:
    """Collect the study for a program."""
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


def _places(roots: np.ndarray) -> list[str]:
    """Name roots by frequency, damping and half plane."""
    said = []
    for root in sorted((r for r in roots if r.imag >= 0), key=abs):
        side = ", right half plane" if root.real > 0 else ""
        frequency = f"{abs(root) / (2 * np.pi):.3g} Hz"
        swing = f", damping {abs(root.real) / abs(root):.3f}" if root.imag > 0 else " (real)"
        said.append(frequency + swing + side)
    return said


RESPONSE = (
    "Points: the runs' mean spectrum over the excitation's; bars: its scatter from run to run."
)
UNSEEN = "The model was given the input alone."
TRAINED = "Two of the runs of the fit."
