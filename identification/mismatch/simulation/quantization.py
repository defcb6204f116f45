"""Quantization grid of a channel, estimated from its values."""

from dataclasses import dataclass

import numpy as np

from slipbench.plant.signals import Floats

CROWDED = 0.3
"""Share of distinct values among all, above which a channel counts as continuous."""
STRAY = 0.15
"""Root mean square distance from integer steps, in steps, above which there is no grid."""
COARSER = 1.5
"""Factor over the stated step, above which a grid is coarser than stated."""


@dataclass(frozen=True)
class QuantizationGrid:
    """Values are phase + n step. step: 0 where the channel counts as continuous."""

    step: float = 0.0
    phase: float = 0.0

    def coarser_than(self, stated: float) -> bool:
        """Return whether the grid is coarser than a stated step; False where none is stated (0)."""
        return 0.0 < COARSER * stated < self.step

    def rounded(self, values: Floats) -> Floats:
        """Return values, of any shape and in the channel's unit, rounded to the grid."""
        if self.step <= 0.0:
            return values
        return np.asarray(self.phase + self.step * np.round((values - self.phase) / self.step))


REACHES = (1.5, 5.0, 20.0, np.inf)
"""Largest spacing of neighbours, in steps, that each refinement of the step uses."""
NO_GRID = QuantizationGrid()


def fit_quantization(values: Floats) -> QuantizationGrid:
    """Fit step and phase to values, (n,), in the unit of the channel.

    An error of a thousandth of the step adds up to a full step after a thousand steps. So all
    spacings are used, not only the smallest.
    """
    distinct = np.unique(np.round(values, 9))
    if distinct.size < 2 or distinct.size > CROWDED * values.size:
        return NO_GRID
    spacings = np.diff(distinct)
    step = float(np.min(spacings))
    for limit in REACHES:
        near = spacings[spacings < limit * step]
        step = float(np.sum(near) / np.sum(np.round(near / step)))
    number = np.concatenate(([0.0], np.cumsum(np.round(spacings / step))))
    step, offset = (float(c) for c in np.polyfit(number, distinct, 1))
    residual = distinct - offset - step * number
    if float(np.sqrt(np.mean(residual**2))) > STRAY * step:
        return NO_GRID
    return QuantizationGrid(step, offset - step * round(offset / step))
