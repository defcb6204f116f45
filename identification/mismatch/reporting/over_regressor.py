"""Residuals and the simulated change of an output, as means over the regressor of an effect."""

import numpy as np

from slipbench.identification.mismatch.curves.trace import over_all, seen_by
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.stack import Integers
from slipbench.identification.mismatch.simulation.regressor import TURN, kind_of
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

BINS = 12
PIECES = 40
"""Pieces of time by which the scatter of means is judged."""
LONGEST = 0.5
"""Seconds by which an output may follow the regressor."""
ENOUGH = 0.25
"""Share of the simulated change that must go along the regressor to be drawn along it."""


def followed(fit: Fit, regressor: str, change: list[Floats]) -> tuple[list[Floats], float]:
    """Return the regressor, as much earlier as the simulated change follows it, and that time, s.

    Empty where the change does not go along it. change: (T,) by record.
    """
    width = fit.model.records[0].grid.width
    courses = _courses(fit, regressor)
    best, x, lag = ENOUGH, list[Floats](), 0
    for late in range(round(LONGEST / width)) if courses else ():
        moved = [np.concatenate((np.full(late, c[0]), c[: c.size - late])) for c in courses]
        share = _explained(moved, change)
        if share > best + 0.01:
            best, x, lag = share, moved, late
    return x, lag * width


def _courses(fit: Fit, regressor: str) -> list[Floats]:
    """Regressor in the bins of every record; empty where no drive tells it."""
    for subsystem in reversed(tuple(fit.model.partition.subsystems)):
        try:
            seen = seen_by(fit, subsystem)
        except PlantError:
            continue
        if regressor in seen[0][1]:
            courses = [over_all(regressor, [one]) for one in seen]
            turns = kind_of(regressor) == TURN
            return [np.mod(c, 2.0 * np.pi) for c in courses] if turns else courses
    return []


def edges_of(x: list[Floats]) -> Floats:
    """Return the edges of bins that hold equally many values."""
    return np.unique(np.quantile(np.concatenate(x), np.linspace(0.0, 1.0, BINS + 1)))


def means(x: list[Floats], y: list[Floats], edges: Floats) -> tuple[Floats, Floats, Floats]:
    """Mean of x and y in every bin, and the 95 % half width of the latter, (bins,) each.

    As means of y in pieces of time scatter. x, y: (T,) by record; edges: of the bins.
    """
    every, over = np.concatenate(y), np.concatenate(x)
    number, pieces = _number(over, edges), np.arange(every.size) * PIECES // every.size
    found = np.full((3, edges.size - 1), np.nan)
    for k in np.unique(number):
        here = number == k
        parts = [every[here & (pieces == p)].mean() for p in np.unique(pieces[here])]
        half = 1.96 * float(np.std(parts)) / max(len(parts) - 1, 1) ** 0.5
        found[:, k] = over[here].mean(), every[here].mean(), half
    return found[0], found[1], found[2]


def _number(over: Floats, edges: Floats) -> Integers:
    return np.clip(np.searchsorted(edges, over, "right") - 1, 0, edges.size - 2)


def _explained(x: list[Floats], y: list[Floats]) -> float:
    """Share of y that its means over the bins of x explain."""
    every, over, edges = np.concatenate(y), np.concatenate(x), edges_of(x)
    whole = float(np.sum((every - every.mean()) ** 2))
    if edges.size < 3 or whole <= 0.0:
        return 0.0
    number = _number(over, edges)
    mean = np.bincount(number, every) / np.maximum(np.bincount(number), 1)
    return 1.0 - float(np.sum((every - mean[number]) ** 2)) / whole
