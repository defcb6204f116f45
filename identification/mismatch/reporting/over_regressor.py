"""Residuals and the simulated change of an output, as means over the regressor of an effect."""

import numpy as np

from slipbench.identification.mismatch.curves.trace import concatenated_bins, regressors_by_record
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.stack import Integers
from slipbench.identification.mismatch.simulation.regressor import TURN, kind_of
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

BINS = 12
PIECES = 40
"""Number of pieces of time for the standard error of the means."""
LONGEST = 0.5
"""Maximum lag of an output behind the regressor, s."""
ENOUGH = 0.25
"""Share of the simulated change that the regressor must explain to be the abscissa."""


def delayed_regressor(fit: Fit, regressor: str, change: list[Floats]) -> tuple[list[Floats], float]:
    """Return the regressor, (T,) by record, delayed by the lag of the simulated change; the lag, s.

    Empty where the regressor does not explain the change. change: (T,) by record.
    """
    width = fit.model.records[0].grid.width
    waveforms = _regressor_waveforms(fit, regressor)
    best, x, lag = ENOUGH, list[Floats](), 0
    for delay in range(round(LONGEST / width)) if waveforms else ():
        delayed = [np.concatenate((np.full(delay, c[0]), c[: c.size - delay])) for c in waveforms]
        share = _explained_share(delayed, change)
        if share > best + 0.01:
            best, x, lag = share, delayed, delay
    return x, lag * width


def _regressor_waveforms(fit: Fit, regressor: str) -> list[Floats]:
    """Return the regressor in the bins of every record; empty where no subsystem provides it."""
    for subsystem in reversed(tuple(fit.model.partition.subsystems)):
        try:
            regressors = regressors_by_record(fit, subsystem)
        except PlantError:
            continue
        if regressor in regressors[0][1]:
            waveforms = [concatenated_bins(regressor, [one]) for one in regressors]
            is_angle = kind_of(regressor) == TURN
            return [np.mod(c, 2.0 * np.pi) for c in waveforms] if is_angle else waveforms
    return []


def edges_of(x: list[Floats]) -> Floats:
    """Return the edges of bins with equal numbers of values, (bins + 1,)."""
    return np.unique(np.quantile(np.concatenate(x), np.linspace(0.0, 1.0, BINS + 1)))


def means(x: list[Floats], y: list[Floats], edges: Floats) -> tuple[Floats, Floats, Floats]:
    """Return the means of x and y by bin, and the 95 % half width of the latter, (bins,) each.

    The half width follows from the means of y by piece of time. x, y: (T,) by record.
    """
    y_all, x_all = np.concatenate(y), np.concatenate(x)
    bin_number, pieces = _bin_numbers(x_all, edges), np.arange(y_all.size) * PIECES // y_all.size
    statistics = np.full((3, edges.size - 1), np.nan)
    for k in np.unique(bin_number):
        in_bin = bin_number == k
        piece_means = [y_all[in_bin & (pieces == p)].mean() for p in np.unique(pieces[in_bin])]
        half_width = 1.96 * float(np.std(piece_means)) / max(len(piece_means) - 1, 1) ** 0.5
        statistics[:, k] = x_all[in_bin].mean(), y_all[in_bin].mean(), half_width
    return statistics[0], statistics[1], statistics[2]


def _bin_numbers(x: Floats, edges: Floats) -> Integers:
    return np.clip(np.searchsorted(edges, x, "right") - 1, 0, edges.size - 2)


def _explained_share(x: list[Floats], y: list[Floats]) -> float:
    """Return the share of the variance of y that its means over the bins of x explain."""
    y_all, x_all, edges = np.concatenate(y), np.concatenate(x), edges_of(x)
    total = float(np.sum((y_all - y_all.mean()) ** 2))
    if edges.size < 3 or total <= 0.0:
        return 0.0
    bin_number = _bin_numbers(x_all, edges)
    mean = np.bincount(bin_number, y_all) / np.maximum(np.bincount(bin_number), 1)
    return 1.0 - float(np.sum((y_all - mean[bin_number]) ** 2)) / total
