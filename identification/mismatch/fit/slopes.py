"""Gradient and normal matrix of the score with respect to all fitted parameters.

The log-likelihood maximised over the noise model is flatter than that of a fixed one: where a step
changes residuals by something that their own past predicts, the noise model follows. Its lags are
one linear regression on past residuals for every whitened output, so that this regression is
projected out of the columns (variable projection: Golub and Pereyra, SIAM Journal on Numerical
Analysis 10 (1973); without the derivative of the regressors: Kaufman, BIT 15 (1975)).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy import linalg

from slipbench.identification.mismatch.fit.fitting import Fit, deviations, parameters
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of
from slipbench.identification.mismatch.fit.whitening import pasts, root_of_normal
from slipbench.identification.mismatch.simulation.once import once
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class Slopes:
    """Derivatives of a score by p variables: coordinates first, then effect parameters.

    columns: whitened sensitivities (rows, p). inside: their coordinates in the noise model's
    regressors, (k, p), empty where the noise model is fixed. precision: of the prior, (p,). slope:
    the gradient of the score, (p,).
    """

    columns: Floats
    inside: Floats
    precision: Floats
    slope: Floats

    @classmethod
    def of(cls, fit: Fit, refit_noise: bool) -> "Slopes":
        """Return the derivatives at a fit. refit_noise: whether the noise is fitted too."""
        columns, now = fit.nuisances.columns, coordinates_of(fit.point)
        precision = np.ones(now.size)
        if fit.candidates:
            columns = np.concatenate((columns, fit.effect_columns), axis=1)
            now = np.concatenate((now, parameters(fit.candidates)))
            precision = np.concatenate((precision, deviations(fit.candidates) ** -2.0))
        inside = in_noise(fit, columns) if refit_noise else np.zeros((0, now.size))
        return cls(columns, inside, precision, columns.T @ fit.whitened_residuals - precision * now)

    @once
    def normal(self) -> Floats:
        """Normal matrix with the prior, (p, p)."""
        projected = self.columns.T @ self.columns - self.inside.T @ self.inside
        return np.asarray(projected + np.diag(self.precision))

    def gain(self, step: Floats) -> float:
        """Return the gain of the score that the linearization predicts for a step, (p,), nats."""
        return float(self.slope @ step - 0.5 * step @ self.normal @ step)


def in_noise(fit: Fit, columns: Floats) -> Floats:
    """Return the coordinates of columns in the noise model's orthonormal regressors, (k, p).

    Refitting the noise model subtracts in_noise(c).T @ in_noise(c) from the normal matrix c.T @ c.
    columns: whitened (rows, p), in the order of `stack.whiten_and_stack`.
    """
    parts = [np.zeros((0, columns.shape[1]))]
    first = 0
    for group, noise, residuals in zip(
        fit.model.partition.groups, fit.noise, fit.residuals, strict=True
    ):
        rows = sum(r.size for r in residuals)
        if noise.order:
            parts.append(
                _in_group(residuals, noise.order, columns[first : first + rows], group.memory)
            )
        first += rows
    return np.concatenate(parts)


def _in_group(
    group_residuals: Sequence[Floats], order: int, columns: Floats, memory: float
) -> Floats:
    """Return the same for one output group.

    group_residuals: (T, m) by record; columns: (rows of the group, p).
    """
    outputs, width = group_residuals[0].shape[1], columns.shape[1]
    past = pasts(group_residuals, order)
    products = np.zeros((order * outputs, outputs * width))
    first = 0
    for regressors, residuals in zip(past, group_residuals, strict=True):
        record_columns = columns[first + order * outputs : first + residuals.size]
        products += regressors.T @ record_columns.reshape(len(regressors), outputs * width)
        first += residuals.size
    root = root_of_normal(past, outputs, memory)
    inside = linalg.solve_triangular(root, products, lower=True)
    return np.asarray(inside.reshape(len(root) * outputs, width))
