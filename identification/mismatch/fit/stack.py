"""Residuals and sensitivities of all blocks and recordings as one least-squares problem."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy import linalg, optimize

from slipbench.identification.mismatch.fit.whitening import Whitener, whitener
from slipbench.identification.mismatch.simulation.model import Model, Series
from slipbench.identification.mismatch.simulation.once import once
from slipbench.plant.signals import Floats

Integers = npt.NDArray[np.int_]
LARGEST = 1 << 24
"""Numbers, rows by columns, that are held at once where many columns are worked on."""


def residuals(model: Model, predicted: Series) -> Series:
    """Recorded less predicted; zero where nothing was recorded."""
    return [
        [(m - p) * k for m, p, k in zip(ms, ps, ks, strict=True)]
        for ms, ps, ks in zip(model.measured, predicted, model.known_bins, strict=True)
    ]


def whiteners(model: Model, rest: Series) -> list[Whitener]:
    """Fit the noise model of every block."""
    return [
        whitener(r, b.order, memory=b.memory)
        for b, r in zip(model.partition.groups, rest, strict=True)
    ]


def whiten_and_stack(model: Model, noise: Sequence[Whitener], series: Series) -> Floats:
    """Whiten everything and lay it end to end: (rows,), or (rows, p) for sensitivities (T, m, p).

    Empty arrays stand for zeros: blocks and records that a change does not touch.
    """
    width = next((s.shape[2:] for rs in series for s in rs if s.ndim == 3), ())
    laid = np.zeros((sum(m.size for ms in model.measured for m in ms), *width))
    first = 0
    for white, ones, measured in zip(noise, series, model.measured, strict=True):
        for one, m in zip(ones, measured, strict=True):
            if one.size:
                laid[first : first + m.size] = white(one).reshape(m.size, *one.shape[2:])
            first += m.size
    return laid


def clusters(model: Model) -> Integers:
    """Number of the stretch of time, within one record, of every whitened row."""
    parts = []
    for measured in model.measured:
        for r, (record, m) in enumerate(zip(model.records, measured, strict=True)):
            count = record.grid.pieces
            within = np.minimum(np.arange(len(m)) * count // len(m), count - 1)
            parts.append(np.repeat(within + 1000 * r, m.shape[1]))
    return np.unique(np.concatenate(parts), return_inverse=True)[1]


def recordings(model: Model) -> Integers:
    """Number of the record of every whitened row."""
    parts = [np.full(m.size, r) for measured in model.measured for r, m in enumerate(measured)]
    return np.concatenate(parts)


def log_likelihood(model: Model, rest: Series, noise: Sequence[Whitener]) -> float:
    """Gaussian log-likelihood of residuals under noise models, up to a constant, nats."""
    spread = sum(
        white.log_determinant(len(one))
        for white, ones in zip(noise, rest, strict=True)
        for one in ones
    )
    return -0.5 * (float(np.sum(whiten_and_stack(model, noise, rest) ** 2)) + spread)


@dataclass(frozen=True, eq=False)
class Nuisances:
    """Sensitivities (rows, p) to what may vary without meaning anything; unit priors."""

    columns: Floats

    @once
    def normal(self) -> Floats:
        """Normal matrix, priors included, (p, p)."""
        return np.asarray(self.columns.T @ self.columns + np.eye(self.columns.shape[1]))

    @once
    def factor(self) -> tuple[Floats, bool]:
        """Cholesky factor of the normal matrix."""
        return linalg.cho_factor(self.normal)

    def solve(self, pushes: Floats) -> Floats:
        """Return coordinates that answer to pushes, (p,) or (p, k)."""
        return np.asarray(linalg.cho_solve(self.factor, pushes))

    def fit(self, series: Floats) -> Floats:
        """Return coordinates that explain a series best, priors weighed in."""
        return self.solve(self.columns.T @ series)

    def project_out(self, series: Floats) -> Floats:
        """Return what of a series the nuisances cannot explain, (rows + p,) or (rows + p, k).

        The last p rows are what the explained part costs: coordinates away from what was believed
        count like residuals, so that what calibration hides only by leaving its priors is seen.
        """
        return self.subtract(series, self.fit(series))

    def products(self, columns: Floats) -> tuple[Floats, Floats]:
        """Return the products of nuisances with columns, and the coordinates that hide these.

        columns: (rows, k); both (p, k). The first transposed times the second is what `off` takes
        from columns.T @ columns: off(columns) need not be made for it.
        """
        products = self.columns.T @ columns
        return products, self.solve(products)

    def subtract(self, columns: Floats, hidden: Floats) -> Floats:
        """Return columns less what coordinates explain of them, (rows + p, k); see `off`."""
        return np.concatenate((columns - self.columns @ hidden, -hidden))

    def projected_residuals(self, aim: Floats, z: Floats) -> Floats:
        """Return residuals at coordinates z, and z itself, off the nuisances, (rows + p,)."""
        step = self.solve(self.columns.T @ aim - z)
        return np.concatenate((aim - self.columns @ step, -z - step))

    def clustered(self, groups: Integers) -> Integers:
        """Return the group of each of those rows; every belief is one of its own."""
        own = 1 + int(groups.max(initial=-1)) + np.arange(self.columns.shape[1])
        return np.concatenate((groups, own))


def bounded(normal: Floats, pushes: Floats, low: Floats, high: Floats) -> Floats:
    """Return coordinates (p,) between bounds that answer to pushes best; normal: priors included."""
    factor = linalg.cho_factor(normal)
    free = np.asarray(linalg.cho_solve(factor, pushes))
    if np.all((free >= low) & (free <= high)):
        return free
    upper = np.triu(factor[0])
    aim = linalg.solve_triangular(upper, pushes, trans="T")
    return np.asarray(optimize.lsq_linear(upper, aim, (low, high), method="bvls").x)
