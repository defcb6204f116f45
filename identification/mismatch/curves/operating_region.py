"""Operating region of a located mismatch: frequency band, operating range and direction."""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.trace import effect_of, regressors
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.identification.mismatch.simulation.regressor import TURN
from slipbench.plant.signals import Floats

NOTHING = 1e-9  # relative to the largest standard deviation of an output's response
MOST = 0.75
"""Minimum share of the gain in one direction to report that direction alone."""


@dataclass(frozen=True)
class OperatingRegion:
    """Operating region of a mismatch.

    band: Hz, contains 80 % of the effect response; region: range of the quantity `along`, SI, that
    contains 80 %. direction: opening, closing or both.
    """

    band: tuple[float, float]
    region: tuple[float, float]
    direction: str
    along: str
    along_unit: str


def operating_region(linear: Linearization, curve: Curve) -> OperatingRegion | None:
    """Return the distribution of a curve's effect response over frequency, range and direction.

    None for a periodic curve of an angle, which acts in all regions, and without an operating
    quantity.
    """
    system = linear.fit.model.system
    subsystem = _subsystem_with(linear, system.operating)
    if curve.kind == TURN or subsystem is None:
        return None
    response = effect_of(linear, curve)
    power, speed, rate = [], [], []
    spectrum: Floats = np.zeros(0)
    grid: Floats = np.zeros(0)
    for r in range(len(linear.fit.model.records)):
        power_by_bin = sum(
            (t[r] ** 2 / np.mean(linear.fit.residuals[b][r] ** 2, axis=0)).sum(axis=1)
            for b, t in enumerate(response)
            if t[r].size
        )
        waveforms = regressors(linear.fit, subsystem, r)
        grid_of_record = linear.fit.model.records[r].grid
        width = grid_of_record.width
        power.append(np.asarray(power_by_bin))
        speed.append(grid_of_record.binned(waveforms[system.operating]))
        rate.append(grid_of_record.binned(waveforms[system.direction]))
        lines = _lines([t[r] for t in response if t[r].size], width)
        if spectrum.size in (0, lines.size):
            grid = np.asarray(np.fft.rfftfreq(len(power[-1]), width), np.float64)
            spectrum = lines + (spectrum if spectrum.size else 0.0)
    weight, rates = np.concatenate(power), np.concatenate(rate)
    opening = float(weight[rates > 0].sum() / max(weight.sum(), 1e-300))
    direction = "opening" if opening > MOST else "closing" if opening < 1 - MOST else "both"
    region = _middle(np.concatenate(speed), weight)
    unit = system.units.get(system.operating, "")
    return OperatingRegion(_middle(grid, spectrum), region, direction, system.operating, unit)


def plainest(fit: Fit, response: Series) -> str:
    """Return the output with the largest effect response relative to its innovations.

    response: unwhitened, (T, m) by output group and record; empty where nothing changes.
    """
    ratios: dict[str, float] = {}
    for block, white, parts in zip(fit.model.partition.groups, fit.noise, response, strict=True):
        spread = np.sqrt(np.sum(np.linalg.inv(white.inverse) ** 2, axis=1))
        for j, output in enumerate(block.outputs):
            ratios[output] = sum(float(np.sum(p[:, j] ** 2)) for p in parts if p.size)
            ratios[output] /= float(spread[j]) ** 2
    return max(ratios, key=lambda output: ratios[output])


def _subsystem_with(linear: Linearization, name: str) -> str | None:
    """Return the last subsystem with a quantity among its regressors; None where there is none."""
    subsystems = reversed(tuple(linear.fit.model.partition.subsystems))
    return next((d for d in subsystems if name and name in regressors(linear.fit, d, 0)), None)


def _lines(traces: list[Floats], width: float) -> Floats:
    """Return the power of the response per frequency bin, outputs normalized; 0 below 0.3 Hz."""
    total = np.zeros(len(traces[0]) // 2 + 1)
    for response in traces:
        centered = response - response.mean(axis=0)
        spread = centered.std(axis=0)
        affected = spread > NOTHING * spread.max()
        lines = np.fft.rfft(centered[:, affected] / spread[affected], axis=0)
        total += np.sum(np.abs(lines) ** 2, axis=1)
    total[: max(int(0.3 * len(traces[0]) * width), 1)] = 0.0
    return total


def _middle(values: Floats, weight: Floats) -> tuple[float, float]:
    """Return the range of values that contains the central 80 % of the weight."""
    order = np.argsort(values)
    share = np.cumsum(weight[order]) / max(float(weight.sum()), 1e-300)
    low, high = np.interp((0.1, 0.9), share, values[order])
    return float(low), float(high)
