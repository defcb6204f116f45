"""When a located mismatch acts: in which band, at which speeds, opening or closing."""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.trace import effect_of, regressors
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.identification.mismatch.simulation.regressor import TURN
from slipbench.plant.signals import Floats

NOTHING = 1e-9  # share of the spread of what shows a trace best
MOST = 0.75
"""Share of the gain that one direction must have to be called the one."""


@dataclass(frozen=True)
class OperatingRegion:
    """band: Hz, that holds 80 % of the trace; region: SI, of what `along` names, that holds 80 %.

    direction: opening, closing or both.
    """

    band: tuple[float, float]
    region: tuple[float, float]
    direction: str
    along: str
    along_unit: str


def operating_region(linear: Linearization, curve: Curve) -> OperatingRegion | None:
    """Weigh the trace of a curve over frequency, operating region and direction.

    What repeats with every turn is always there; then there is nothing to weigh.
    """
    system = linear.fit.model.system
    subsystem = _drive(linear, system.operating)
    if curve.kind == TURN or subsystem is None:
        return None
    trace = effect_of(linear, curve)
    power, speed, rate = [], [], []
    spectrum: Floats = np.zeros(0)
    grid: Floats = np.zeros(0)
    for r in range(len(linear.fit.model.records)):
        one = sum(
            (t[r] ** 2 / np.mean(linear.fit.residuals[b][r] ** 2, axis=0)).sum(axis=1)
            for b, t in enumerate(trace)
            if t[r].size
        )
        seen = regressors(linear.fit, subsystem, r)
        recorded = linear.fit.model.records[r].grid
        width = recorded.width
        power.append(np.asarray(one))
        speed.append(recorded.binned(seen[system.operating]))
        rate.append(recorded.binned(seen[system.direction]))
        lines = _lines([t[r] for t in trace if t[r].size], width)
        if spectrum.size in (0, lines.size):
            grid = np.asarray(np.fft.rfftfreq(len(power[-1]), width), np.float64)
            spectrum = lines + (spectrum if spectrum.size else 0.0)
    weight, course = np.concatenate(power), np.concatenate(rate)
    opening = float(weight[course > 0].sum() / max(weight.sum(), 1e-300))
    direction = "opening" if opening > MOST else "closing" if opening < 1 - MOST else "both"
    region = _middle(np.concatenate(speed), weight)
    unit = system.units.get(system.operating, "")
    return OperatingRegion(_middle(grid, spectrum), region, direction, system.operating, unit)


def plainest(fit: Fit, trace: Series) -> str:
    """Return the output that shows a trace best, by what is new in each of its bins."""
    told: dict[str, float] = {}
    for block, white, parts in zip(fit.model.partition.groups, fit.noise, trace, strict=True):
        spread = np.sqrt(np.sum(np.linalg.inv(white.inverse) ** 2, axis=1))
        for j, output in enumerate(block.outputs):
            told[output] = sum(float(np.sum(p[:, j] ** 2)) for p in parts if p.size)
            told[output] /= float(spread[j]) ** 2
    return max(told, key=lambda output: told[output])


def _drive(linear: Linearization, name: str) -> str | None:
    """Last drive that tells a quantity."""
    subsystems = reversed(tuple(linear.fit.model.partition.subsystems))
    return next((d for d in subsystems if name and name in regressors(linear.fit, d, 0)), None)


def _lines(traces: list[Floats], width: float) -> Floats:
    """Power of the trace at every line above the slow road, all outputs in their own spread."""
    total = np.zeros(len(traces[0]) // 2 + 1)
    for trace in traces:
        level = trace - trace.mean(axis=0)
        spread = level.std(axis=0)
        shows = spread > NOTHING * spread.max()
        lines = np.fft.rfft(level[:, shows] / spread[shows], axis=0)
        total += np.sum(np.abs(lines) ** 2, axis=1)
    total[: max(int(0.3 * len(traces[0]) * width), 1)] = 0.0
    return total


def _middle(values: Floats, weight: Floats) -> tuple[float, float]:
    """Range of values that holds the middle 80 % of the weight."""
    order = np.argsort(values)
    share = np.cumsum(weight[order]) / max(float(weight.sum()), 1e-300)
    low, high = np.interp((0.1, 0.9), share, values[order])
    return float(low), float(high)
