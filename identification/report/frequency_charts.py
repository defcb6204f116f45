"""Charts over frequency: Bode in dB and linear, Nichols, fitted models."""

import numpy as np

from slipbench.identification.models.recommended import Recommended
from slipbench.identification.report import drawing as d
from slipbench.identification.report.chart import Chart, Panel, Trace
from slipbench.identification.report.words import decibel_axis, gain_axis, name, response_unit
from slipbench.identification.response.response import (
    RELIABLE_COHERENCE,
    FrequencyResponse,
    reliable_band,
)

COLOURS = (d.BLUE, d.ORANGE, d.GREEN, d.VIOLET, d.RED, "#0d8f9c", "#8a6d1d", "#b5478f")
FREQUENCY = "frequency / Hz"
MODEL_POINTS = 300


def bode_chart(found: list[FrequencyResponse], labels: list[str] | None = None) -> Chart:
    """Gain (dB or linear), phase and coherence of responses with 95 % intervals.

    labels: one for each response; by default its input and output.
    """
    factor, unit = response_unit(found[0])
    said = labels or [f"{name(r.input)} to {name(r.output)}" for r in found]
    gain, phase, coherence = [], [], []
    for one, label, colour in zip(found, said, COLOURS * (1 + len(found) // 8), strict=False):
        f, known = one.frequency, one.reliable
        value, half = factor * one.gain, factor * one.gain_band
        angle, wide = np.degrees(one.phase), np.degrees(one.phase_band)
        low = np.maximum(value - half, 0.1 * value)
        gain += [
            Trace(label, f, np.where(known, value, np.nan), colour, low, value + half),
            Trace("", f, value, colour, faint=True),
        ]
        phase += [
            Trace(label, f, np.where(known, angle, np.nan), colour, angle - wide, angle + wide),
            Trace("", f, angle, colour, faint=True),
        ]
        coherence.append(Trace(label, f, one.coherence, colour))
    span = (float(found[0].frequency[0]), float(found[0].frequency[-1]))
    return Chart(
        (
            _gain_panel(gain, unit, span, _gain_range(found, factor)),
            Panel(
                tuple(phase),
                "phase / °",
                x_log=True,
                x_range=span,
                y_range=_phase_range(found),
                height=2.2,
            ),
            Panel(
                tuple(coherence),
                "coherence",
                FREQUENCY,
                x_log=True,
                x_range=span,
                y_range=(0.0, 1.05),
                level=(RELIABLE_COHERENCE,),
                height=1.3,
            ),
        )
    )


def model_chart(found: tuple[Recommended, ...]) -> Chart:
    """Gain and phase of models with 95 % intervals and of the bins that they were fitted to."""
    factor, unit = response_unit(found[0].response)
    gain, phase = [], []
    for one, colour in zip(found, COLOURS, strict=False):
        lines, fit = one.fit.lines, one.fit
        f = _frequencies(one)
        value, band = fit.response(f), fit.band(f)
        size = np.abs(value)
        label = f"from {name(one.response.input)}: {fit.order}"
        low, high = factor * np.maximum(size - band, 0.1 * size), factor * (size + band)
        gain.append(Trace(label, f, factor * size, colour, low, high))
        gain.append(Trace("", lines.frequency, factor * np.abs(lines.value), colour, points=True))
        angle, half = np.degrees(np.unwrap(np.angle(value))), np.degrees(fit.phase_band(f))
        phase.append(Trace(label, f, angle, colour, angle - half, angle + half))
        near = np.degrees(np.angle(lines.value / fit.response(lines.frequency)))
        measured = np.interp(lines.frequency, f, angle) + near
        phase.append(Trace("", lines.frequency, measured, colour, points=True))
    return Chart(
        (
            _gain_panel(gain, unit, None, None),
            Panel(tuple(phase), "phase / °", FREQUENCY, x_log=True),
        )
    )


def nichols_chart(responses: list[FrequencyResponse], models: tuple[Recommended, ...]) -> Chart:
    """Gain in dB over phase: reliable bins of the responses, and the models."""
    factor, unit = response_unit(responses[0])
    traces = []
    for one, colour in zip(responses, COLOURS, strict=False):
        known = one.reliable
        x, y = np.degrees(one.phase)[known], 20 * np.log10(factor * one.gain[known])
        notes = tuple(f"{f:.3g} Hz" for f in one.frequency[known])
        label = f"{name(one.input)}, measured"
        traces.append(Trace(label, x, y, colour, points=True, notes=notes))
    for model, colour in zip(models, COLOURS, strict=False):
        f = _frequencies(model)
        value = model.fit.response(f)
        phase = np.degrees(np.unwrap(np.angle(value)))
        notes = tuple(f"{one:.3g} Hz" for one in f)
        label = f"{name(model.response.input)}, model"
        traces.append(
            Trace(label, phase, 20 * np.log10(factor * np.abs(value)), colour, notes=notes)
        )
    label = decibel_axis(unit)
    return Chart((Panel(tuple(traces), label, "phase / °", plane=True, height=3.6),), linked=False)


def _frequencies(of: Recommended) -> np.ndarray:
    lines = of.fit.lines.frequency
    low, high = reliable_band(of.response) or (lines[0], lines[-1])
    return np.geomspace(low, high, MODEL_POINTS)


def _gain_panel(
    traces: list[Trace],
    unit: str,
    span: tuple[float, float] | None,
    reach: tuple[float, float] | None,
) -> Panel:
    return Panel(
        tuple(traces),
        gain_axis(unit),
        x_log=True,
        y_log=True,
        gain=True,
        x_range=span,
        y_range=reach,
        height=2.6,
    )


def _gain_range(found: list[FrequencyResponse], factor: float) -> tuple[float, float] | None:
    known = [r.gain[r.reliable] for r in found if r.reliable.any()]
    if not known:
        return None
    low, high = min(g.min() for g in known), max(g.max() for g in known)
    room = max(1.6, 2.5 * np.sqrt(low / high))
    return float(low * factor / room), float(high * factor * room)


def _phase_range(found: list[FrequencyResponse]) -> tuple[float, float] | None:
    known = [np.degrees(r.phase[r.reliable]) for r in found if r.reliable.any()]
    if not known:
        return None
    return float(min(p.min() for p in known)) - 25, float(max(p.max() for p in known)) + 25
