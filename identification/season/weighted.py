"""Weighted least squares of values with intervals, and the scatter between runs beyond the intervals."""

from dataclasses import dataclass

import numpy as np
from scipy import optimize

from slipbench.protocol.recording.channel import FloatArray


@dataclass(frozen=True)
class Fit:
    """A linear model of values.

    coefficients  (p,), in the unit of the values per unit of each column
    covariance    (p, p), for variances that are those of the weights
    residual      sum of the squared residuals over their variances
    freedom       n - p
    """

    coefficients: FloatArray
    covariance: FloatArray
    residual: float
    freedom: int

    @property
    def scale(self) -> float:
        """Variance of the residuals over that of the weights."""
        return self.residual / self.freedom


def fit(columns: FloatArray, value: FloatArray, variance: FloatArray) -> Fit:
    """Least squares fit, weighted by the inverse of the variances.

    columns: (n, p), n > p, of full rank; value: (n,) in any unit; variance: (n,) in its square
    """
    root = np.sqrt(variance)
    left, right = columns / root[:, None], value / root
    norm = np.linalg.norm(left, axis=0)
    q, r = np.linalg.qr(left / norm)
    inverse = np.linalg.inv(r) / norm[:, None]
    found = inverse @ (q.T @ right)
    residual = float(np.sum((right - left @ found) ** 2))
    return Fit(found, inverse @ inverse.T, residual, value.size - columns.shape[1])


def variances(
    columns: FloatArray, value: FloatArray, deviation: FloatArray
) -> tuple[FloatArray, float]:
    """Variance of each value about a linear model, and the part of it that all share: between runs.

    The variance between runs is the one with which the weighted sum of squares is what it is expected
    to be; 0 where the intervals alone explain the residuals. (R. C. Paule and J. Mandel, "Consensus
    values and weighting factors", J. Res. Natl. Bur. Stand. 87 (1982) 377.)

    columns: (n, p), n > p; value, deviation: (n,) in one unit. Where no value has a deviation all
    variances are equal, of the size of the residuals, and none is between runs beside them.
    """
    ones = np.ones_like(value)
    plain = fit(columns, value, ones)
    most = max(plain.residual, np.finfo(float).tiny)
    if not deviation.any():
        return ones * max(plain.scale, np.finfo(float).tiny), 0.0

    def excess(between: float) -> float:
        made = fit(columns, value, deviation**2 + between)
        return made.residual - made.freedom

    if excess(0.0) <= 0:
        return deviation**2, 0.0
    while excess(most) > 0:
        most *= 4
    between = float(optimize.brentq(excess, 0.0, most, xtol=1e-12 * most, rtol=1e-12))
    return deviation**2 + between, between
