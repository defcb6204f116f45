"""Residuals and sensitivities of all output groups and recordings as one least-squares problem."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import linalg, optimize

from slipbench.identification.mismatch.fit.whitening import Whitener, even, scale_of, whitener
from slipbench.identification.mismatch.simulation.model import Model, Series
from slipbench.identification.mismatch.simulation.once import once
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

Integers = npt.NDArray[np.int_]
LARGEST = 1 << 24
"""Largest number of matrix elements, rows by columns, held at once."""


def residuals(model: Model, predicted: Series) -> Series:
    """Measured minus predicted outputs, (T, m); zero where nothing was measured."""
    return [
        [(m - p) * k for m, p, k in zip(ms, ps, ks, strict=True)]
        for ms, ps, ks in zip(model.measured, predicted, model.known_bins, strict=True)
    ]


def whiteners(model: Model, residual: Series) -> list[Whitener]:
    """Fit the noise model of every output group to residuals (T, m)."""
    return [
        even(scale_of(r)) if model.white else whitener(r, b.order, memory=b.memory)
        for b, r in zip(model.partition.groups, residual, strict=True)
    ]


def whiten_and_stack(model: Model, noise: Sequence[Whitener], series: Series) -> Floats:
    """Whiten and stack: (rows,), or (rows, p) for sensitivities (T, m, p).

    Empty arrays stand for zeros: output groups and records that a change does not affect.
    """
    width = next((s.shape[2:] for rs in series for s in rs if s.ndim == 3), ())
    stacked = np.zeros((sum(m.size for ms in model.measured for m in ms), *width))
    first = 0
    for whitener_of_group, of_group, measured in zip(noise, series, model.measured, strict=True):
        for one, m in zip(of_group, measured, strict=True):
            if one.size:
                stacked[first : first + m.size] = whitener_of_group(one).reshape(
                    m.size, *one.shape[2:]
                )
            first += m.size
    return stacked


def clusters(model: Model) -> Integers:
    """Index of the time segment, within one record, of every whitened row, shape (rows,)."""
    parts = []
    for measured in model.measured:
        for r, (record, m) in enumerate(zip(model.records, measured, strict=True)):
            segments = record.grid.pieces
            segment = np.minimum(np.arange(len(m)) * segments // len(m), segments - 1)
            parts.append(np.repeat(segment + 1000 * r, m.shape[1]))
    return np.unique(np.concatenate(parts), return_inverse=True)[1]


def recordings(model: Model) -> Integers:
    """Index of the record of every whitened row, shape (rows,)."""
    parts = [np.full(m.size, r) for measured in model.measured for r, m in enumerate(measured)]
    return np.concatenate(parts)


def log_likelihood(model: Model, residual: Series, noise: Sequence[Whitener]) -> float:
    """Gaussian log-likelihood of residuals (T, m) under noise models, up to a constant, nats."""
    log_determinant = sum(
        noise_of_group.log_determinant(len(one))
        for noise_of_group, of_group in zip(noise, residual, strict=True)
        for one in of_group
    )
    return -0.5 * (float(np.sum(whiten_and_stack(model, noise, residual) ** 2)) + log_determinant)


@dataclass(frozen=True, eq=False)
class Nuisances:
    """Sensitivities (rows, p) to nuisance parameters with unit priors."""

    columns: Floats

    @once
    def normal(self) -> Floats:
        """Normal matrix with the prior, (p, p)."""
        return np.asarray(self.columns.T @ self.columns + np.eye(self.columns.shape[1]))

    @once
    def factor(self) -> tuple[Floats, bool]:
        """Cholesky factor of the normal matrix, (p, p), and whether it is the lower one."""
        return _factor(self.normal)

    def solve(self, correlations: Floats) -> Floats:
        """Return the MAP coordinates for correlations with the columns, (p,) or (p, k)."""
        return np.asarray(linalg.cho_solve(self.factor, correlations))

    def fit(self, series: Floats) -> Floats:
        """Return the MAP coordinates for a series, (p,) or (p, k)."""
        return self.solve(self.columns.T @ series)

    def project_out(self, series: Floats) -> Floats:
        """Return a series with the nuisances projected out, (rows + p,) or (rows + p, k).

        The last p rows are the prior terms of the fitted coordinates. They count like residuals, so
        that the cost of moving parameters away from their priors is included.
        """
        return self.subtract(series, self.fit(series))

    def products(self, columns: Floats) -> tuple[Floats, Floats]:
        """Return the products of nuisances with columns, and the coordinates fitted to the columns.

        columns: (rows, k); both (p, k). The first transposed times the second is what `project_out`
        subtracts from columns.T @ columns; project_out(columns) need not be computed for it.
        """
        products = self.columns.T @ columns
        return products, self.solve(products)

    def subtract(self, columns: Floats, coordinates: Floats) -> Floats:
        """Return columns minus their fit by coordinates, (rows + p, k); see `project_out`."""
        return np.concatenate((columns - self.columns @ coordinates, -coordinates))

    def projected_residuals(self, whitened: Floats, z: Floats) -> Floats:
        """Return residuals at coordinates z with the nuisances projected out, (rows + p,).

        The last p rows are the prior terms.
        """
        step = self.solve(self.columns.T @ whitened - z)
        return np.concatenate((whitened - self.columns @ step, -z - step))

    def clustered(self, clusters: Integers) -> Integers:
        """Return the cluster of each of those rows, (rows + p,); every prior term is its own."""
        prior_rows = 1 + int(clusters.max(initial=-1)) + np.arange(self.columns.shape[1])
        return np.concatenate((clusters, prior_rows))


def _factor(normal: Floats) -> tuple[Floats, bool]:
    """Return the Cholesky factor of a normal matrix with its prior, and whether it is the lower.

    Raises PlantError where sensitivities are not finite, or so large that the others are rounding
    errors beside them.
    """
    try:
        return linalg.cho_factor(normal)
    except (linalg.LinAlgError, ValueError) as cause:  # ValueError: not finite
        # Sensitivities diverge where a time constant is shorter than an integration step.
        raise PlantError(
            "the sensitivities diverge",
            where="step of a fit",
            expected="a time constant of at least one integration step",
            found=str(cause),
            remedy="bound the time constants, or give a shorter step",
        ) from cause


def bounded(normal: Floats, gradient: Floats, low: Floats, high: Floats) -> Floats:
    """Return the coordinates z, (p,), between bounds that minimise z' normal z / 2 - gradient' z.

    normal: (p, p), prior included; gradient, low, high: (p,). Raises PlantError where the
    sensitivities diverge.
    """
    factor = _factor(normal)
    unbounded = np.asarray(linalg.cho_solve(factor, gradient))
    if np.all((unbounded >= low) & (unbounded <= high)):
        return unbounded
    upper = np.triu(factor[0])
    target = linalg.solve_triangular(upper, gradient, trans="T")
    return np.asarray(optimize.lsq_linear(upper, target, (low, high), method="bvls").x)
