"""What a block leaves unexplained is coloured and shared between its outputs; whitening undoes it.

A vector autoregression e_t = sum A_k e_(t-k) + L n_t, n white with unit variance, is fitted to the
residuals (Luetkepohl, New Introduction to Multiple Time Series Analysis, chapter 3). Filtered by
it, residuals and sensitivities enter least squares with equal weight.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from slipbench.identification.mismatch.simulation.once import once
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class Whitener:
    """lags: (order, m, m); inverse: (m, m), of the innovations' Cholesky factor."""

    lags: Floats
    inverse: Floats

    @property
    def order(self) -> int:
        """Number of lags."""
        return len(self.lags)

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of the innovations' covariance."""
        return -2.0 * float(np.log(np.diag(self.inverse)).sum())

    def __call__(self, series: Floats) -> Floats:
        """Whiten (T, m) or (T, m, p); the first `order` rows are lost.

        A row of the result is one product of matrices: the filter's, which is the same for all
        rows, and the window of the last `order` + 1 rows, which is contiguous and is not copied.
        """
        length, m = series.shape[:2]
        rows = np.ascontiguousarray(series).reshape(length * m, -1)
        taps = self._taps
        if rows.shape[1] == 1:
            windows = sliding_window_view(rows[:, 0], taps.shape[1])[::m]
            white = windows @ taps.T
        else:
            windows = sliding_window_view(rows, taps.shape[1], axis=0)[::m]
            white = np.matmul(taps, windows.transpose(0, 2, 1))
        return np.asarray(white.reshape(length - self.order, *series.shape[1:]))

    @once
    def _taps(self) -> Floats:
        """What each whitened row takes of the rows up to it, oldest first, (m, m (order + 1))."""
        taps = [-self.inverse @ lag for lag in self.lags[::-1]] + [self.inverse]
        return np.concatenate(taps, axis=1)


def whitener(
    residuals: Sequence[Floats], order: int, ridge: float = 1e-4, memory: float = math.inf
) -> Whitener:
    """Fit the noise model of one block to the residuals of all its records, each (T, m).

    memory: rows within which noise is forgotten to a share of 1/e; without it a noise model takes
    every slow course of a wrong simulation for noise, and nothing holds slow parameters any more.
    """
    m = residuals[0].shape[1]
    scale = np.sqrt(np.mean(np.concatenate(residuals) ** 2, axis=0)) + 1e-12
    now = np.concatenate([r[order:] for r in residuals]) / scale
    lags = np.zeros((order, m, m))
    rest = now
    if order:
        past = np.concatenate([_past(r / scale, order) for r in residuals])
        normal = past.T @ past + ridge * len(past) * np.eye(order * m)
        found = np.linalg.solve(normal, past.T @ now)
        fading = np.exp(-np.arange(1, order + 1) / memory)
        found *= np.repeat(fading, m)[:, None]
        rest = now - past @ found
        lags = found.reshape(order, m, m).transpose(0, 2, 1) * scale[:, None] / scale
    freedom = max(len(now) - order * m, len(now) // 2)
    covariance = rest.T @ rest / freedom + 1e-12 * np.eye(m)
    inverse = np.linalg.inv(np.linalg.cholesky(covariance)) / scale
    return Whitener(lags, inverse)


def _past(series: Floats, order: int) -> Floats:
    rows = [series[order - k : len(series) - k] for k in range(1, order + 1)]
    return np.concatenate(rows, axis=1)
