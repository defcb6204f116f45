"""The steps in which a channel was told, read off its values."""

from dataclasses import dataclass

import numpy as np

from slipbench.plant.signals import Floats

CROWDED = 0.3
"""Share of distinct values among all, above which they are as good as continuous."""
STRAY = 0.15
"""Root mean square distance from whole steps, in steps, above which there are none."""
COARSER = 1.5
"""Times what was promised, from which on steps are coarser than promised."""


@dataclass(frozen=True)
class QuantizationGrid:
    """Values are phase + n step. step: 0 where they are as good as continuous."""

    step: float = 0.0
    phase: float = 0.0

    def coarser_than(self, promised: float) -> bool:
        """Tell whether these steps break a promise; where nothing was promised none is broken."""
        return 0.0 < COARSER * promised < self.step

    def rounded(self, values: Floats) -> Floats:
        """Return values, of any shape and in the channel's unit, on the nearest steps."""
        if self.step <= 0.0:
            return values
        return np.asarray(self.phase + self.step * np.round((values - self.phase) / self.step))


REACHES = (1.5, 5.0, 20.0, np.inf)
"""Steps between neighbours from which on the step is told, the nearest first."""
NO_GRID = QuantizationGrid()


def fit_quantization(values: Floats) -> QuantizationGrid:
    """Fit step and phase to values.

    A thousand steps away from nought, a step that is wrong by a thousandth is wrong by all of it,
    so that not the least distance counts but all of them.
    """
    told = np.unique(np.round(values, 9))
    if told.size < 2 or told.size > CROWDED * values.size:
        return NO_GRID
    apart = np.diff(told)
    step = float(np.min(apart))
    for reach in REACHES:
        near = apart[apart < reach * step]
        step = float(np.sum(near) / np.sum(np.round(near / step)))
    number = np.concatenate(([0.0], np.cumsum(np.round(apart / step))))
    step, first = (float(c) for c in np.polyfit(number, told, 1))
    stray = told - first - step * number
    if float(np.sqrt(np.mean(stray**2))) > STRAY * step:
        return NO_GRID
    return QuantizationGrid(step, first - step * round(first / step))
