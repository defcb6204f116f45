"""How the score of a fit changes with everything that is fitted, to second order.

The log-likelihood maximised over the noise model is flatter than that of a fixed one: where a step
changes residuals by something that their own past predicts, the noise model follows. Its lags are
one linear regression on past residuals for every whitened output, so the columns count off that
regression (variable projection: Golub and Pereyra, SIAM Journal on Numerical Analysis 10 (1973);
without the derivative of the regressors: Kaufman, BIT 15 (1975)).
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
    """Slopes of a score by coordinates first, then dials; p of them.

    columns: whitened sensitivities (rows, p). inside: their coordinates in the noise model's
    regressors, (k, p), empty where the noise model is fixed. precision: of the prior, (p,).
    slope: the gradient of the score, (p,).
    """

    columns: Floats
    inside: Floats
    precision: Floats
    slope: Floats

    @classmethod
    def of(cls, fit: Fit, along: bool) -> "Slopes":
        """Return those of a fit. along: whether the noise model is fitted along."""
        columns, now = fit.nuisances.columns, coordinates_of(fit.point)
        precision = np.ones(now.size)
        if fit.candidates:
            columns = np.concatenate((columns, fit.effect_columns), axis=1)
            now = np.concatenate((now, parameters(fit.candidates)))
            precision = np.concatenate((precision, deviations(fit.candidates) ** -2.0))
        inside = in_noise(fit, columns) if along else np.zeros((0, now.size))
        return cls(columns, inside, precision, columns.T @ fit.whitened_residuals - precision * now)

    @once
    def normal(self) -> Floats:
        """Normal matrix with the prior, (p, p)."""
        whole = self.columns.T @ self.columns - self.inside.T @ self.inside
        return np.asarray(whole + np.diag(self.precision))


def in_noise(fit: Fit, columns: Floats) -> Floats:
    """Return the coordinates of columns in the noise model's regressors, orthonormal, (k, p).

    The noise model takes in_noise(c).T @ in_noise(c) of the normal matrix c.T @ c.
    columns: whitened (rows, p), in the order of `stack.flat`.
    """
    parts = [np.zeros((0, columns.shape[1]))]
    first = 0
    for block, noise, rest in zip(
        fit.model.partition.groups, fit.noise, fit.residuals, strict=True
    ):
        rows = sum(r.size for r in rest)
        if noise.order:
            parts.append(_in_block(rest, noise.order, columns[first : first + rows], block.memory))
        first += rows
    return np.concatenate(parts)


def _in_block(rest: Sequence[Floats], order: int, columns: Floats, memory: float) -> Floats:
    """Return the same for one block. rest: (T, m) by record; columns: (rows of the block, p)."""
    outputs, width = rest[0].shape[1], columns.shape[1]
    past = pasts(rest, order)
    products = np.zeros((order * outputs, outputs * width))
    first = 0
    for of_one, residuals in zip(past, rest, strict=True):
        own = columns[first + order * outputs : first + residuals.size]
        products += of_one.T @ own.reshape(len(of_one), outputs * width)
        first += residuals.size
    root = root_of_normal(past, outputs, memory)
    inside = linalg.solve_triangular(root, products, lower=True)
    return np.asarray(inside.reshape(len(root) * outputs, width))
