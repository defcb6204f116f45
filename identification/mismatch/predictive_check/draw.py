"""A system drawn from the posterior of a fit, as the normal distribution about it."""

from dataclasses import replace

import numpy as np
from scipy import linalg

from slipbench.identification.mismatch.analysis import Analysis, accepted
from slipbench.identification.mismatch.fit.fitting import Fit, deviations
from slipbench.identification.mismatch.fit.optimize import limits_of, there
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of
from slipbench.plant.signals import Floats

SHARES = (1.0, 0.5, 0.0)
"""Of a step away from the fit; shorter ones where the simulation cannot follow."""


def drawn(a: Analysis, rng: np.random.Generator) -> tuple[Fit, Fit | None]:
    """Draw parameters, effects and the slow unknown: training and held-out.

    A free curve that stands for the effects is taken as it was fitted: its knots have no posterior.
    """
    fit, held_out = accepted(a), a.proof[2] if a.proof else None
    if a.free is None or fit is not a.free.fit:
        fit = _moved(fit, rng)
    if held_out is None:
        return fit, None
    system = fit.model.at(fit.point)
    model = replace(held_out.model, system=system)
    beside = _moved(held_out, rng)
    return fit, replace(beside, model=model)


def bare(fit: Fit, held_out: Fit | None) -> tuple[Fit, Fit | None]:
    """Take what was found away; parameters and slow unknowns stay."""
    model = replace(fit.model, injected=())
    fit = replace(fit, model=model, point=replace(fit.point, effects=()), candidates=())
    if held_out is None:
        return fit, None
    model = replace(held_out.model, system=fit.model.at(fit.point), injected=())
    return fit, replace(held_out, model=model)


def _moved(fit: Fit, rng: np.random.Generator) -> Fit:
    step = _step(fit, rng)
    z = coordinates_of(fit.point)
    low, high = limits_of(fit, z, np.inf)
    for share in SHARES:
        dz = np.clip(share * step[: z.size], low - z, high - z)
        if (new := there(fit, dz, share * step[z.size :])) is not None:
            return new
    return fit


def _step(fit: Fit, rng: np.random.Generator) -> Floats:
    """Draw a step, coordinates first, then dials, from the inverse of the normal matrix."""
    columns = fit.nuisances.columns
    weights = np.ones(columns.shape[1])
    if fit.candidates:
        columns = np.concatenate((columns, fit.effect_columns), axis=1)
        weights = np.concatenate((weights, deviations(fit.candidates) ** -2.0))
    upper = linalg.cholesky(columns.T @ columns + np.diag(weights))
    return np.asarray(linalg.solve_triangular(upper, rng.standard_normal(len(upper))))
