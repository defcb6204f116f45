"""Draw residuals from the noise models of a fit.

The innovations of each autoregression are resampled in blocks and filtered by it again. A block has
the length of a segment within which errors may be correlated, a random first row and a random sign;
it continues at the first row after the last one: a circular block bootstrap (Politis and Romano,
"A circular block-resampling procedure for stationary data", 1992). This keeps the variance
inflation by clustered errors, the nonstationary variance and the correlation between outputs
without a model of them.
"""

import numpy as np
from scipy import linalg

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.whitening import Whitener
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.plant.signals import Floats

STABLE = 0.98
"""Largest modulus of the roots of an autoregression: noise then decays within the warm-up."""


def noise_like(fit: Fit, rng: np.random.Generator) -> Series:
    """Draw noise like the residuals of a fit, (T, m) by group and record, in the outputs' units."""
    factor = _degrees_of_freedom_factor(fit)
    noise: Series = [[] for _ in fit.noise]
    for r, record in enumerate(fit.model.records):
        pieces = record.grid.pieces
        starts = rng.random(2 * pieces + 2)
        signs = rng.choice((-1.0, 1.0), starts.size)
        for b, white in enumerate(fit.noise):
            residual = fit.residuals[b][r]
            innovations = _resampled_in_blocks(
                white.innovations(residual) * factor, 2 * len(residual), pieces, starts, signs
            )
            noise[b].append(coloured(white, innovations)[-len(residual) :])
    return noise


def coloured(white: Whitener, innovations: Floats) -> Floats:
    """Filter innovations (T, m) by an autoregression: the inverse of whitening, (T, m)."""
    root = np.linalg.inv(white.inverse)
    lags, disturbances = _stable(white.lags), innovations @ root.T
    series = np.zeros((len(disturbances) + len(lags), disturbances.shape[1]))
    for t, disturbance in enumerate(disturbances, start=len(lags)):
        past = series[t - len(lags) : t][::-1]
        series[t] = disturbance + np.einsum("kij,kj->i", lags, past)
    return series[len(lags) :]


def _resampled_in_blocks(
    rows: Floats, length: int, pieces: int, starts: Floats, signs: Floats
) -> Floats:
    """Resample rows (n, m) in blocks. starts: first row by block, as a fraction of n."""
    block_length = -(-length // (len(starts) - 2))
    row = np.floor(starts * len(rows)).astype(int)[:, None] + np.arange(block_length)
    drawn = rows[row % len(rows)] * signs[:, None, None]
    return np.asarray(drawn.reshape(-1, rows.shape[1])[:length])


def _degrees_of_freedom_factor(fit: Fit) -> float:
    """Return the factor that corrects innovations for the degrees of freedom of the fit."""
    columns = fit.nuisances.columns
    used_freedom = float(np.trace(linalg.cho_solve(fit.nuisances.factor, columns.T @ columns)))
    used_freedom += sum(len(c.parameters) for c in fit.candidates)
    return float(np.sqrt(len(columns) / max(len(columns) - used_freedom, 0.5 * len(columns))))


def _stable(lags: Floats) -> Floats:
    """Return lags (n, m, m), scaled so that the modulus of no root exceeds STABLE."""
    order, m = lags.shape[:2]
    if not order:
        return lags
    companion = np.eye(order * m, k=-m)
    companion[:m] = lags.transpose(1, 0, 2).reshape(m, order * m)
    root = float(np.max(np.abs(np.linalg.eigvals(companion))))
    if root <= STABLE:
        return lags
    return lags * ((STABLE / root) ** np.arange(1, order + 1))[:, None, None]
