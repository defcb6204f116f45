"""Prediction of recordings by a system that was fitted to others.

What the other recordings did not excite is not known after they were fitted: the mass of a car that
never braked is known as well as the file states it. A prediction with the fitted values alone counts
the error of such a parameter against the effects of the fit. Therefore parameters may move within
their posterior of the other recordings (posterior predictive distribution, at its maximum).
"""

from dataclasses import dataclass, replace

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit, renoised
from slipbench.identification.mismatch.fit.optimize import (
    SETTLED,
    SHARES,
    STEPS,
    after_step,
    limits_of,
)
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of, sensitivities
from slipbench.identification.mismatch.fit.slopes import Slopes
from slipbench.identification.mismatch.fit.stack import bounded, log_likelihood
from slipbench.identification.mismatch.simulation.model import Model, predict
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class Belief:
    """Normal distribution of all coordinates of a point. mean: (p,); precision: (p, p)."""

    mean: Floats
    precision: Floats

    def score(self, fit: Fit) -> float:
        """Return the log-likelihood of a fit's residuals plus the log-density of its point, nats."""
        moved = coordinates_of(fit.point) - self.mean
        likelihood = log_likelihood(fit.model, fit.residuals, fit.noise)
        return likelihood - 0.5 * float(moved @ self.precision @ moved)


def belief(fit: Fit, slow: int) -> Belief:
    """Return the posterior of a fit's parameters. slow: number of slow coordinates of others.

    Clocks and slow coordinates are those of the other recordings, with unit priors. The information
    of the recordings counts less where errors are correlated over time.
    """
    slopes, count = Slopes.of(fit, refit_noise=True), len(fit.point.x)
    prior = np.diag(slopes.precision)
    information = (slopes.normal - prior) / max(fit.variance_inflation.inflation, 1.0)
    covariance = np.linalg.inv(information + prior)
    own = np.flatnonzero([not k.of_clock for k in fit.model.known])
    mean, precision = np.zeros(count + slow), np.eye(count + slow)
    mean[own] = fit.point.x[own]
    precision[np.ix_(own, own)] = np.linalg.inv(covariance[np.ix_(own, own)])
    return Belief(mean, precision)


def predictive(fit: Fit, there: Fit, model: Model) -> float:
    """Return the log-likelihood of recordings predicted by a fit of others, nats.

    model: the fitted system on the recordings. there: a simulation of them with the fitted values,
    where clocks, slow disturbance and noise model are estimated.
    """
    clocks = iter(there.point.x)
    x = [next(clocks) if k.of_clock else at for k, at in zip(model.known, fit.point.x, strict=True)]
    point = replace(model.origin(), x=np.array(x), q=there.point.q, effects=fit.point.effects)
    known = belief(fit, sum(q.size for q in point.q))
    start = Fit(model, point, predict(model, point), there.noise, sensitivities(model, point))
    return known.score(_most_probable(renoised(start), known))


def _most_probable(fit: Fit, known: Belief) -> Fit:
    for _ in range(STEPS):
        new = _step(fit, known)
        if known.score(new) - known.score(fit) < SETTLED:
            return new
        fit = new
    return fit


def _step(fit: Fit, known: Belief) -> Fit:
    """Return the fit after the first share of a Gauss-Newton step that improves it, else `fit`."""
    slopes, z = Slopes.of(fit, refit_noise=True), coordinates_of(fit.point)
    data = slopes.normal - np.diag(slopes.precision)
    gradient = slopes.columns.T @ fit.whitened_residuals + data @ z
    low, high = limits_of(fit, z)
    target = gradient + known.precision @ known.mean
    full = bounded(data + known.precision, target, low, high) - z
    for share in SHARES:
        stepped = after_step(fit, share * full, np.zeros(0))
        if stepped is not None and known.score(new := renoised(stepped)) > known.score(fit):
            return new
    return fit
