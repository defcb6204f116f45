"""The figures of the memo: the located curve, and held-out residuals before and after."""

from collections.abc import Mapping

import numpy as np

from identification.mismatch.explain import Analysis
from identification.mismatch.held_out import driven
from identification.mismatch.locate import Curve
from identification.report import drawing as d
from plant.signals import Floats


def curve_svg(curve: Curve, units: Mapping[str, str]) -> str:
    """Draw what a place asks for along its quantity. units: of quantities, by name."""
    with d.hand():
        figure, (axes,) = d.panels(1, 2.8)
        axes.axhline(0.0, color=d.MUTED, lw=0.8)
        axes.plot(curve.knots, curve.values, color=d.BLUE, marker="o", ms=4)
        unit = units.get(curve.regressor, "")
        axes.set(xlabel=f"{curve.regressor} / {unit}", ylabel=f"{curve.place} / {curve.unit}")
        return d.svg(figure, "located")


def residuals_svg(a: Analysis, output: str) -> str:
    """Draw residuals of one output on the first held-out run: in time, and their spectra."""
    assert a.held_out is not None
    assert a.base is not None
    assert a.named is not None
    before, after = (
        driven(a.held_out, f.model.at(f.point), a.named.fit) for f in (a.base, a.named.fit)
    )
    place = [(b, k.outputs.index(output)) for b, k in enumerate(a.held_out.chain.blocks)
             if output in k.outputs]  # fmt: skip
    (b, j), record = place[0], a.held_out.records[0]
    pairs = [(f.rest[b][0][:, j], colour, label) for f, colour, label in (
        (before, d.ORANGE, "re-calibrated"), (after, d.BLUE, "with what was found"))]  # fmt: skip
    unit = record.sensors[output].unit
    with d.hand():
        figure, (time, frequency) = d.side_by_side(2, 3.0)
        for rest, colour, label in pairs:
            d.line(time, record.grid.centre[: rest.size], rest, color=colour, label=label, lw=0.9)
            f, amplitude = _spectrum(rest, record.grid.width)
            frequency.semilogy(f, amplitude, color=colour, lw=0.9)
        time.set(xlabel="time / s", ylabel=f"recorded less simulated / {unit}")
        frequency.set(
            xlabel="frequency / Hz",
            ylabel=f"amplitude / {unit}",
            xlim=(0.0, 0.25 / record.grid.width),
        )
        d.legend(time, 2)
        return d.svg(figure, "held_out")


def _spectrum(rest: Floats, width: float) -> tuple[Floats, Floats]:
    window = np.hanning(rest.size)
    line = np.abs(np.fft.rfft(rest * window)) * 2.0 / window.sum()
    frequency: Floats = np.asarray(np.fft.rfftfreq(rest.size, width))
    return frequency, np.maximum(line, 1e-12)
