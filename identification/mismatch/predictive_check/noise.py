"""Residuals drawn again from the noise models of a fit.

The innovations of each autoregression (what it leaves of the residuals) are drawn in blocks and
passed through it again. A block is as long as a segment within which errors may be correlated, begins anywhere, runs
around the end of the recording, and has a random sign: a circular block bootstrap (Politis and
Romano, "A circular block-resampling procedure for stationary data", 1992). So the variance
inflation of segments, quiet and loud parts, and what the outputs of a recording share are kept
without a model of them.
"""

import numpy as np
from scipy import linalg

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.whitening import Whitener
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.plant.signals import Floats

STABLE = 0.98
"""Largest root of an autoregression, so that noise dies out within the warm-up."""


def noise_like(fit: Fit, rng: np.random.Generator) -> Series:
    """Noise like the residuals of a fit, (T, m) by block and record, in the outputs' units."""
    share = _share_of_parameters(fit)
    found: Series = [[] for _ in fit.noise]
    for r, record in enumerate(fit.model.records):
        pieces = record.grid.pieces
        starts = rng.random(2 * pieces + 2)
        signs = rng.choice((-1.0, 1.0), starts.size)
        for b, white in enumerate(fit.noise):
            rest = fit.residuals[b][r]
            drawn = _in_blocks(
                white.innovations(rest) * share, 2 * len(rest), pieces, starts, signs
            )
            found[b].append(coloured(white, drawn)[-len(rest) :])
    return found


def coloured(white: Whitener, innovations: Floats) -> Floats:
    """Pass innovations (T, m) through an autoregression: the inverse of whitening, (T, m)."""
    root = np.linalg.inv(white.inverse)
    lags, pushes = _stable(white.lags), innovations @ root.T
    found = np.zeros((len(pushes) + len(lags), pushes.shape[1]))
    for t, push in enumerate(pushes, start=len(lags)):
        past = found[t - len(lags) : t][::-1]
        found[t] = push + np.einsum("kij,kj->i", lags, past)
    return found[len(lags) :]


def _in_blocks(rows: Floats, length: int, pieces: int, starts: Floats, signs: Floats) -> Floats:
    """Draw rows (n, m) in blocks. starts: share of the way through the rows, by block."""
    size = -(-length // (len(starts) - 2))
    number = np.floor(starts * len(rows)).astype(int)[:, None] + np.arange(size)
    drawn = rows[number % len(rows)] * signs[:, None, None]
    return np.asarray(drawn.reshape(-1, rows.shape[1])[:length])


def _share_of_parameters(fit: Fit) -> float:
    """Factor by which fitted parameters have made innovations too small."""
    columns = fit.nuisances.columns
    used = float(np.trace(linalg.cho_solve(fit.nuisances.factor, columns.T @ columns)))
    used += sum(len(c.parameters) for c in fit.candidates)
    return float(np.sqrt(len(columns) / max(len(columns) - used, 0.5 * len(columns))))


def _stable(lags: Floats) -> Floats:
    """Return lags (n, m, m) whose largest root is inside the unit circle."""
    order, m = lags.shape[:2]
    if not order:
        return lags
    companion = np.eye(order * m, k=-m)
    companion[:m] = lags.transpose(1, 0, 2).reshape(m, order * m)
    root = float(np.max(np.abs(np.linalg.eigvals(companion))))
    if root <= STABLE:
        return lags
    return lags * ((STABLE / root) ** np.arange(1, order + 1))[:, None, None]
