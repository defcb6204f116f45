"""Predictive density of a run under a hypothesis, from the runs before it.

Under a hypothesis the vehicle's parameters and the parameters of its effect are fitted to the runs
before; near that fit both are Gaussian (Laplace). The new run is predicted there, to first order:

    whitened residual  ~  t( N delta,  I + N S N' + Q Q',  FREEDOM )

N: sensitivities to both sets of parameters, with their posterior mean delta and covariance S; Q:
those to the slow unknown of the new run (wind, slope) and to its clocks, with unit priors.
Whitening filters and their scale are those of the runs before. The multivariate t states that the
noise level of a new run differs from theirs (scaled inverse chi-square): no residual is so
improbable that one run decides alone.

Errors that are serially correlated within segments carry less information than white ones: the
likelihood of the runs before counts with a power of one over the variance inflation of the fit.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import linalg, special

from slipbench.identification.experiments.hypothesis import NOTHING, Hypothesis
from slipbench.identification.experiments.sequential_test import RunEvidence
from slipbench.identification.mismatch.fit.calibrate import (
    at_prior_mean,
    beyond_prior,
    calibrate,
    map_fit,
)
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.refit import relinearized
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of, sensitivities
from slipbench.identification.mismatch.naming.fits import fitted
from slipbench.identification.mismatch.reporting.open_questions import TYPICAL_SPREAD
from slipbench.identification.mismatch.simulation.model import Model, models, predict
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

FREEDOM = 4.0
"""Degrees of freedom of the noise level of a new run: within a factor of 2 of the earlier ones."""


@dataclass(frozen=True, eq=False)
class Learnt:
    """Posterior from the runs before, under a hypothesis.

    fit: of these runs; mean, factor: of the deviation of coordinates (not of clocks) and effect
    parameters from it, (k,) and (k, k), the covariance is factor factor'
    """

    fit: Fit
    mean: Floats
    factor: Floats


def run_evidence(
    system: System,
    earlier: Sequence[Record],
    new: Record,
    questions: Sequence[Sequence[Hypothesis]],
) -> tuple[RunEvidence, ...]:
    """Logarithmic densities of a run for each question: hypotheses that exclude each other.

    system: as before these runs, with the effects that are not in question; earlier: the runs
    before.
    """
    before, after = models(system, earlier, [new])
    base = calibrate(before, before.origin())
    power = min(1.0, 1.0 / base.variance_inflation.inflation)
    known = dict[tuple[str, bool], float | None]()
    found = []
    for question in questions:
        as_stated = any(h.name == NOTHING for h in question)
        for h in question:
            if (h.name, as_stated) not in known:
                known[h.name, as_stated] = _log_density(_learnt(base, h, as_stated, power), after)
        found.append(
            _evidence(new.name, {h.name: known[h.name, as_stated] for h in question}, power)
        )
    return tuple(found)


def _evidence(run: str, densities: Mapping[str, float | None], power: float) -> RunEvidence:
    """Evidence of a run; none where a hypothesis could not be simulated, which does not refute it."""
    known = {name: value for name, value in densities.items() if value is not None}
    if len(known) < len(densities):
        return RunEvidence(run, dict.fromkeys(densities, 0.0), 0.0)
    return RunEvidence(run, known, power)


def _learnt(base: Fit, hypothesis: Hypothesis, as_stated: bool, power: float) -> Learnt | None:
    """Posterior under a hypothesis; None where it cannot be simulated.

    as_stated: the size keeps its stated prior, or one about its typical value, since the runs
    before hardly show it: fitted freely it would fall to nothing, and "nothing" and the effect be
    the same.
    """
    candidate = hypothesis.candidate
    if candidate is None:
        return _posterior(base, np.zeros(0), np.zeros(0), power)
    if not as_stated:
        fit = fitted(base, candidate)
        if fit is None:
            return None
        own = fit.effects[-1]
        return _posterior(fit, np.asarray(own.parameters), np.asarray(own.deviations), power)
    found = _beside(base, candidate)
    if found is None:
        return None
    fit = replace(found, candidates=(candidate,))
    spread = np.ones(len(candidate.parameters))
    spread[0] = hypothesis.spread or TYPICAL_SPREAD * abs(candidate.size)
    return _posterior(fit, np.zeros(spread.size), spread, power)


def _beside(base: Fit, candidate: Candidate) -> Fit | None:
    """Fit the vehicle beside an effect of a given size; None where that cannot run.

    Numbers that made up for the effect keep it away, so where some are far from the file the fit
    begins there as well: with a backlash of 13 mrad that was 1 900 nats better.
    """
    try:
        there = replace(with_effects(base, (candidate,)), candidates=())
        fit = optimize(there)
        if not beyond_prior(base):
            return fit
        return max(fit, map_fit(relinearized(at_prior_mean(there))), key=lambda f: f.score)
    except PlantError:
        return None


def _posterior(fit: Fit, off: Floats, spread: Floats, power: float) -> Learnt:
    """Gaussian about a fit. off: effect parameters less prior means; spread: prior deviations."""
    z, columns = coordinates_of(fit.point), fit.nuisances.columns
    if spread.size:
        columns = np.concatenate((columns, fit.effect_columns), axis=1)
    weights = np.concatenate((np.ones(z.size), spread**-2.0))
    normal = power * columns.T @ columns + np.diag(weights)
    slope = power * columns.T @ fit.whitened_residuals - weights * np.concatenate((z, off))
    covariance = np.linalg.inv(normal)
    own = np.concatenate((_parameters(fit.model), z.size + np.arange(spread.size))).astype(int)
    return Learnt(
        fit, (covariance @ slope)[own], linalg.cholesky(covariance[np.ix_(own, own)], lower=True)
    )


def _parameters(model: Model) -> list[int]:
    """Numbers of the coordinates that are the same in all runs: those of the vehicle, not of clocks."""
    return [i for i, known in enumerate(model.known) if not known.of_clock]


def _log_density(learnt: Learnt | None, model: Model) -> float | None:
    """Logarithmic predictive density of the one record of a model, nats, up to a constant.

    None where the hypothesis cannot be simulated.
    """
    if learnt is None:
        return None
    there = replace(model.origin(), x=learnt.fit.point.x, effects=learnt.fit.point.effects)
    try:
        predicted = predict(model, there)
        slopes = sensitivities(model, there)
    except PlantError:
        return None
    fit = Fit(model, there, predicted, learnt.fit.noise, slopes, learnt.fit.candidates)
    return log_t_density(fit.whitened_residuals, *_columns(fit, learnt)) - 0.5 * _log_scale(fit)


def _columns(fit: Fit, learnt: Learnt) -> tuple[Floats, Floats]:
    """Expected whitened residual (rows,), and columns (rows, k) that spread it with unit normals."""
    all_of_it, own = fit.nuisances.columns, _parameters(fit.model)
    shared = all_of_it[:, own]
    if fit.candidates:
        shared = np.concatenate((shared, fit.effect_columns), axis=1)
    of_this_run = np.delete(all_of_it, own, axis=1)
    spread = np.concatenate((shared @ learnt.factor, of_this_run), axis=1)
    return shared @ learnt.mean, spread


def _log_scale(fit: Fit) -> float:
    """Logarithm of the determinant of the noise covariance of all rows."""
    return float(
        sum(
            white.log_determinant(len(residual))
            for white, residuals in zip(fit.noise, fit.residuals, strict=True)
            for residual in residuals
        )
    )


def log_t_density(values: Floats, mean: Floats, columns: Floats) -> float:
    """Logarithm of a multivariate t with FREEDOM degrees, location `mean` and scale I + C C', nats.

    values, mean: whitened, shape (rows,); columns C: shape (rows, k). Kotz and Nadarajah,
    "Multivariate t Distributions and Their Applications", Cambridge 2004, equation 1.1.
    """
    residual, rows = values - mean, values.size
    factor = linalg.cho_factor(columns.T @ columns + np.eye(columns.shape[1]))
    projection = columns.T @ residual
    square = float(residual @ residual - projection @ linalg.cho_solve(factor, projection))
    log_determinant = 2.0 * float(np.sum(np.log(np.diag(factor[0]))))
    half = 0.5 * (FREEDOM + rows)
    constant = special.gammaln(half) - special.gammaln(0.5 * FREEDOM)
    constant -= 0.5 * rows * np.log(np.pi * FREEDOM)
    return float(constant - 0.5 * log_determinant - half * np.log1p(square / FREEDOM))
