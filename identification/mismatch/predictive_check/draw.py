"""Draw a system from the posterior of a fit, in normal approximation."""

from dataclasses import replace

import numpy as np
from scipy import linalg

from slipbench.identification.mismatch.analysis import Analysis, accepted
from slipbench.identification.mismatch.fit.fitting import Fit, deviations
from slipbench.identification.mismatch.fit.optimize import after_step, limits_of
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of
from slipbench.plant.signals import Floats

SHARES = (1.0, 0.5, 0.0)
"""Fractions of a drawn step; the smaller ones where the simulation fails at the full step."""


def draw_from_posterior(a: Analysis, rng: np.random.Generator) -> tuple[Fit, Fit | None]:
    """Draw parameters, effects and the slow disturbance: training and held-out fit.

    A free curve that replaces the effects is not drawn: its knots have no posterior.
    """
    fit, held_out = accepted(a), a.held_out_runs[2] if a.held_out_runs else None
    if a.free is None or fit is not a.free.fit:
        fit = _displaced(fit, rng)
    if held_out is None:
        return fit, None
    system = fit.model.at(fit.point)
    model = replace(held_out.model, system=system)
    drawn_held_out = _displaced(held_out, rng)
    return fit, replace(drawn_held_out, model=model)


def without_effects(fit: Fit, held_out: Fit | None) -> tuple[Fit, Fit | None]:
    """Remove effects and free curves from both fits; parameters and slow disturbances stay."""
    model = replace(fit.model, injected=())
    fit = replace(fit, model=model, point=replace(fit.point, effects=()), candidates=())
    if held_out is None:
        return fit, None
    model = replace(held_out.model, system=fit.model.at(fit.point), injected=())
    return fit, replace(held_out, model=model)


def _displaced(fit: Fit, rng: np.random.Generator) -> Fit:
    step = _posterior_step(fit, rng)
    z = coordinates_of(fit.point)
    low, high = limits_of(fit, z, np.inf)
    for fraction in SHARES:
        step_in_bounds = np.clip(fraction * step[: z.size], low - z, high - z)
        if (displaced := after_step(fit, step_in_bounds, fraction * step[z.size :])) is not None:
            return displaced
    return fit


def _posterior_step(fit: Fit, rng: np.random.Generator) -> Floats:
    """Draw a step, (p,), from N(0, inverse normal matrix): coordinates, then effect parameters."""
    columns = fit.nuisances.columns
    weights = np.ones(columns.shape[1])
    if fit.candidates:
        columns = np.concatenate((columns, fit.effect_columns), axis=1)
        weights = np.concatenate((weights, deviations(fit.candidates) ** -2.0))
    upper = linalg.cholesky(columns.T @ columns + np.diag(weights))
    return np.asarray(linalg.solve_triangular(upper, rng.standard_normal(len(upper))))
