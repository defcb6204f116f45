"""Whitening of the residuals of an output group, which are serially and mutually correlated.

A vector autoregression e_t = sum A_k e_(t-k) + L n_t, n white with unit variance, is fitted to the
residuals (Luetkepohl, New Introduction to Multiple Time Series Analysis, chapter 3). Filtered by
it, residuals and sensitivities enter least squares with equal weight.

The first rows of a recording have too few predecessors. They are weighted by the covariance of as
many successive rows anywhere, with DOUBTED times its standard deviations. Without them the initial
states of a recording, and what decays within these rows, would not be identifiable. At full weight
they would depend on inputs before the recording, which act through delays and lags and are unknown.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from slipbench.identification.mismatch.simulation.once import once
from slipbench.plant.signals import Floats

DOUBTED = 10.0
"""Factor on the noise deviations of the first rows: they have 1 % of the weight of others."""
RIDGE = 1e-4
"""Ridge in shares of the mean square of residuals: regularizes lags of outputs that hardly move."""


@dataclass(frozen=True, eq=False)
class Whitener:
    """lags: (order, m, m); inverse: (m, m), inverse Cholesky factor of the innovations.

    start: (order m, order m), the same of the first `order` rows together, oldest first.
    """

    lags: Floats
    inverse: Floats
    start: Floats

    @property
    def order(self) -> int:
        """Number of lags."""
        return len(self.lags)

    @property
    def log_innovations(self) -> float:
        """Logarithm of the determinant of the innovations' covariance."""
        return -2.0 * float(np.log(np.diag(self.inverse)).sum())

    def log_determinant(self, rows: int) -> float:
        """Logarithm of the determinant of the covariance of a series of `rows` rows."""
        return -2.0 * float(self._log_scales(rows).sum())

    def log_densities(self, series: Floats) -> Floats:
        """Log-density of every row given the previous rows, (T,), nats up to a constant."""
        return np.asarray(self._log_scales(len(series)) - 0.5 * np.sum(self(series) ** 2, axis=1))

    def _log_scales(self, rows: int) -> Floats:
        m = len(self.inverse)
        first = np.log(np.diag(self.start)).reshape(self.order, m).sum(axis=1)[:rows]
        return np.concatenate((first, np.full(rows - len(first), -0.5 * self.log_innovations)))

    def __call__(self, series: Floats) -> Floats:
        """Whiten all rows of a series, (T, m) or (T, m, p)."""
        first = self.opening(series[: self.order])
        if len(series) <= self.order:
            return first
        return np.concatenate((first, self.innovations(series)))

    def opening(self, rows: Floats) -> Floats:
        """Whiten the first rows of a series, at most `order`, (rows, m) or (rows, m, p)."""
        count = rows.shape[0] * rows.shape[1]
        stacked = np.ascontiguousarray(rows).reshape(count, math.prod(rows.shape[2:]))
        return np.asarray((self.start[:count, :count] @ stacked).reshape(rows.shape))

    def innovations(self, series: Floats) -> Floats:
        """Whiten the rows after the first `order` of a longer series, (T, m) or (T, m, p).

        A row of the result is one matrix product of the filter, which is the same for all rows, and
        the window of the last `order` + 1 rows, which is contiguous and not copied.
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
        """Filter coefficients of a whitened row, oldest row first, (m, m (order + 1))."""
        taps = [-self.inverse @ lag for lag in self.lags[::-1]] + [self.inverse]
        return np.concatenate(taps, axis=1)


def whitener(
    residuals: Sequence[Floats], order: int, ridge: float = RIDGE, memory: float = math.inf
) -> Whitener:
    """Fit the noise model of one output group to the residuals of all its records, each (T, m).

    memory: number of rows after which lags are damped to 1/e. Without it a noise model attributes
    every slow error of a wrong simulation to noise, and slow parameters are not identifiable.
    """
    m = residuals[0].shape[1]
    scale = scale_of(residuals)
    present = np.concatenate([r[order:] for r in residuals]) / scale
    lags = np.zeros((order, m, m))
    start = np.zeros((0, 0))
    innovations = present
    if order:
        past = np.concatenate(pasts(residuals, order))
        normal = _normal(past, ridge)
        coefficients = np.linalg.solve(normal, past.T @ present)
        coefficients *= _fading(order, m, memory)[:, None]
        innovations = present - past @ coefficients
        lags = coefficients.reshape(order, m, m).transpose(0, 2, 1) * scale[:, None] / scale
        start = _inverse_root(_oldest_first(normal / len(past), m))
        start /= DOUBTED * np.tile(scale, order)
    freedom = max(len(present) - order * m, len(present) // 2)
    covariance = innovations.T @ innovations / freedom + 1e-12 * np.eye(m)
    return Whitener(lags, _inverse_root(covariance) / scale, start)


def pasts(residuals: Sequence[Floats], order: int) -> list[Floats]:
    """Return the regressors of the lags, shape (T - order, order m) by record, in output scales.

    residuals: (T, m) by record.
    """
    scale = scale_of(residuals)
    return [_past(r / scale, order) for r in residuals]


def root_of_normal(past: Sequence[Floats], outputs: int, memory: float) -> Floats:
    """Return the lower Cholesky factor of the lags' normal matrix, shape (order m, order m).

    past: of all records, see `pasts`. The damping of a lag enters as the equivalent ridge.
    """
    normal = _normal(np.concatenate(past), RIDGE)
    fading = _fading(len(normal) // outputs, outputs, memory)
    return np.asarray(np.linalg.cholesky(normal + np.diag(np.diag(normal) * (1.0 / fading - 1.0))))


def _normal(past: Floats, ridge: float) -> Floats:
    return np.asarray(past.T @ past + ridge * len(past) * np.eye(past.shape[1]))


def _fading(order: int, outputs: int, memory: float) -> Floats:
    return np.repeat(np.exp(-np.arange(1, order + 1) / memory), outputs)


def _past(series: Floats, order: int) -> Floats:
    rows = [series[order - k : len(series) - k] for k in range(1, order + 1)]
    return np.concatenate(rows, axis=1)


def _oldest_first(covariance: Floats, m: int) -> Floats:
    """Reverse the order of rows in time of a covariance (order m, order m)."""
    order = len(covariance) // m
    reversed_order = np.arange(order * m).reshape(order, m)[::-1].ravel()
    return covariance[np.ix_(reversed_order, reversed_order)]


def _inverse_root(covariance: Floats) -> Floats:
    """Return the inverse of the lower Cholesky factor."""
    return np.asarray(np.linalg.inv(np.linalg.cholesky(covariance)))


def scale_of(residuals: Sequence[Floats]) -> Floats:
    """Root mean square of residuals, (T, m) each, by output, (m,)."""
    return np.asarray(np.sqrt(np.mean(np.concatenate(residuals) ** 2, axis=0)) + 1e-12)


def even(scale: Floats) -> Whitener:
    """Return the noise model of independent white residuals of this scale, (m,)."""
    return Whitener(np.zeros((0, scale.size, scale.size)), np.diag(1.0 / scale), np.zeros((0, 0)))
