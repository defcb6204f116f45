"""Figures of a design: Nyquist plot, sensitivities, setpoint steps."""

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

from slipbench.identification.design.from_runs import Path
from slipbench.identification.design.steps import step_response
from slipbench.identification.design.widest import Designed
from slipbench.identification.report import drawing as d
from slipbench.identification.response.response import ComplexArray
from slipbench.protocol.recording.channel import FloatArray

SHOWN = (0.2, 60.0)  # Hz
LASTING = 0.6  # s


def nyquist(path: Path, designed: Designed) -> Figure:
    """Nyquist plot of all members with the disc that the limit of M_s excludes."""
    with d.style():
        figure, (axes,) = d.side_by_side(1, 5.2)
        angle = np.linspace(0, 2 * np.pi, 200)
        radius = 1 / path.problem.required.sensitivity
        axes.fill(-1 + radius * np.cos(angle), radius * np.sin(angle), color=d.SHADE)
        axes.plot([-1], [0], "+", color=d.RED, markersize=10)
        for (name, (_, loop)), color in zip(
            _loops(path, designed).items(), _colours(), strict=False
        ):
            axes.plot(loop.real, loop.imag, color=color, label=name)
        axes.set(xlim=(-2.2, 1.2), ylim=(-2.0, 1.0), xlabel="Re L", ylabel="Im L", aspect="equal")
        d.legend(axes, 3)
    return figure


def sensitivities(path: Path, designed: Designed) -> Figure:
    """Figure of |S| and |T| over frequency."""
    with d.style():
        figure, axes = d.panels(2, 5.2)
        for (name, (f, loop)), color in zip(
            _loops(path, designed).items(), _colours(), strict=False
        ):
            axes[0].loglog(f, np.abs(1 / (1 + loop)), color=color, label=name)
            axes[1].loglog(f, np.abs(loop / (1 + loop)), color=color)
        axes[0].axhline(path.problem.required.sensitivity, color=d.RED, ls="--", lw=0.9)
        axes[1].axhline(np.sqrt(0.5), color=d.MUTED, ls="--", lw=0.9)
        axes[0].set(ylabel="|S|")
        axes[1].set(ylabel="|T|", xlabel="frequency / Hz", xlim=SHOWN, ylim=(0.05, 3))
        d.legend(axes[0], 3)
    return figure


def steps(path: Path, designed: Designed) -> Figure:
    """Figure of slip after a setpoint step, for all members."""
    time = np.arange(0.0, LASTING, 0.002)
    with d.style():
        figure, (axes,) = d.panels(1, 3.2)
        found = step_response(path.problem, designed.controller, time, designed.prefilter.response)
        for (name, y), color in zip(found.items(), _colours(), strict=False):
            axes.plot(time, y, color=color, label=name)
        axes.axhline(1.0, color=d.MUTED, lw=0.8)
        axes.set(xlabel="time / s", ylabel="slip / step height")
        d.legend(axes, 3)
    return figure


def _colours() -> list[str]:
    return [d.BLUE, d.ORANGE, d.GREEN, d.VIOLET, d.RED, d.MUTED] * 4


def _coloured(
    path: Path, designed: Designed
) -> Iterator[tuple[str, tuple[FloatArray, ComplexArray], str]]:
    for (name, loop), color in zip(_loops(path, designed).items(), _colours(), strict=False):
        yield name, loop, color


def _loops(path: Path, designed: Designed) -> dict[str, tuple[FloatArray, ComplexArray]]:
    """Frequency and loop gain by member, the nominal one first."""
    problem, law = path.problem, designed.controller
    f = problem.frequency
    found = {"nominal": (f, law.response(f) * problem.path(f))}
    around = problem.around
    for name, values in (around.members if around else {}).items():
        assert around is not None
        known = np.isfinite(values)
        at = around.frequency[known]
        found[name] = at, law.response(at) * problem.path(at, values[known])
    return found
