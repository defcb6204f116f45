"""Charts of models: poles and zeros, step response, held-out time series, residual tests."""

import numpy as np

from slipbench.identification.models.recommended import Recommended
from slipbench.identification.models.residual_tests import CorrelationTest, NoTests
from slipbench.identification.models.roots import Root, roots_with_intervals
from slipbench.identification.models.step_response import step_response
from slipbench.identification.models.validation import Validation
from slipbench.identification.report import drawing as d
from slipbench.identification.report.chart import Chart, Panel, Trace
from slipbench.identification.report.frequency_charts import COLOURS
from slipbench.identification.report.words import axis, name, response_unit, shown, unit
from slipbench.identification.response.response import ComplexArray

HERTZ = 1 / (2 * np.pi)
GAP = np.array([complex(np.nan, np.nan)])
FASTEST = 3.0  # times the top of the band; a faster root is not shown
BROADEST = 1.0  # a region wider than its root's frequency is not drawn: it would hide the others


def roots_chart(models: tuple[Recommended, ...]) -> Chart:
    """Poles (x) and zeros (o) of models in the s plane, in Hz, with 95 % regions."""
    traces = []
    for one, colour in zip(models, COLOURS, strict=False):
        top = FASTEST * one.fit.lines.frequency[-1]
        for kind, roots in zip(("poles", "zeros"), roots_with_intervals(one.fit), strict=True):
            near = [root for root in roots if HERTZ * abs(root.value) < top]
            if near:
                label = f"{name(one.response.input)}: {kind}"
                traces += _roots_traces(label, kind, near, colour)
    axes = "imaginary part / Hz", "real part / Hz"
    return Chart((Panel(tuple(traces), *axes, plane=True, height=3.6),), linked=False)


def _roots_traces(label: str, kind: str, roots: list[Root], colour: str) -> list[Trace]:
    both = list(roots) + [Root(r.value.conjugate(), r.covariance) for r in roots if not r.real]
    at = HERTZ * np.array([r.value for r in both])
    traces = [
        Trace(
            label,
            at.real,
            at.imag,
            colour,
            points=True,
            marker="x" if kind == "poles" else "o",
            notes=tuple(_root_in_words(r) for r in both),
        )
    ]
    drawn = [r for r in roots if max(r.half_widths) <= BROADEST * abs(r.value)]
    edges: list[ComplexArray] = []
    for root in drawn:
        edge = HERTZ * root.outline()
        edges += [edge, GAP]
        if not root.real:
            edges += [np.conj(edge), GAP]
    if edges:
        outline = np.concatenate(edges)
        traces.append(Trace("", outline.real, outline.imag, colour, faint=True))
    return traces


def _root_in_words(root: Root) -> str:
    frequency = HERTZ * abs(root.value)
    real, imaginary = (HERTZ * w for w in root.half_widths)
    if root.real:
        return f"{frequency:.3g} ± {real:.2g} Hz, real"
    damping = -root.value.real / abs(root.value)
    return (
        f"{frequency:.3g} Hz, damping ratio {damping:.3g}; 95 %: real part ± {real:.2g} Hz,"
        f" imaginary part ± {imaginary:.2g} Hz"
    )


def step_chart(models: tuple[Recommended, ...]) -> Chart:
    """Response of models to a unit step of their input, with 95 % bands."""
    traces = []
    for one, colour in zip(models, COLOURS, strict=False):
        factor, _ = response_unit(one.response)
        step = step_response(one.fit)
        value, half = factor * step.value, factor * step.half_width
        label = f"from {name(one.response.input)}"
        traces.append(Trace(label, step.time, value, colour, value - half, value + half))
    _, each = response_unit(models[0].response)
    output = name(models[0].response.output)
    return Chart(
        (
            Panel(
                tuple(traces),
                axis(output, f"({each})" if each != "1" else each),
                "time / s",
                height=2.8,
            ),
        )
    )


def validation_chart(checked: Validation) -> Chart:
    """Measured and predicted output over time, and the residual, on held-out data."""
    units = checked.unit, checked.stated
    measured, predicted = (_deviation(x, *units) for x in (checked.measured, checked.predicted))
    label = axis(name(checked.output), unit(*units))
    lines = (
        Trace("measured", checked.time, measured, d.VIOLET),
        Trace("model", checked.time, predicted, d.ORANGE),
    )
    residual = (Trace("residual", checked.time, measured - predicted, d.MUTED),)
    below = axis("residual", unit(*units))
    return Chart((Panel(lines, label, height=2.6), Panel(residual, below, "time / s", height=1.3)))


def _deviation(x: np.ndarray, si: str, stated: str) -> np.ndarray:
    """A deviation in the display unit: no offset, as that of a temperature."""
    return np.asarray(shown(x, si, stated) - shown(np.zeros(1), si, stated))


def residual_chart(checked: Validation) -> Chart | None:
    """Autocorrelation of the residual and cross-correlation with the input; None without tests."""
    tests = checked.tests
    if isinstance(tests, NoTests):
        return None
    return Chart(
        (
            _correlation(tests.autocorrelation, "Autocorrelation of the residual"),
            _correlation(tests.cross_correlation, "Residual and input; lag > 0: input first"),
        ),
        linked=False,
        side=True,
    )


def _correlation(of: CorrelationTest, title: str) -> Panel:
    stems_x = np.repeat(of.lag, 3)
    stems_y = np.column_stack((np.zeros(of.lag.size), of.value, np.full(of.lag.size, np.nan)))
    top = 1.15 * max(float(of.value.max()), 1.6 * of.bound)
    return Panel(
        (
            Trace("", stems_x, stems_y.ravel(), d.BLUE),
            Trace("correlation", of.lag, of.value, d.BLUE, points=True),
        ),
        "magnitude",
        "lag / s",
        title,
        plane=True,
        level=(of.bound,),
        y_range=(0.0, top),
        height=2.8,
    )
