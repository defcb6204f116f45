"""Confidence intervals of effect parameters under errors correlated within time segments."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special, stats

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.sensitivity import change, coordinates_of
from slipbench.identification.mismatch.fit.sizing import SHAPE, is_log_scaled, limits, shapes, sizes
from slipbench.identification.mismatch.fit.stack import Integers, recordings, whiten_and_stack
from slipbench.identification.mismatch.fit.variance_inflation import amplitude_p, cluster_variances
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.identification.mismatch.thresholds import FORMULA_WIDTH, UNIDENTIFIABLE
from slipbench.plant.parameters import Parameter
from slipbench.plant.signals import Floats

CONFIDENCE = 0.95
FEW = 3
"""Smallest number of recordings from which the variation between trials is estimated as well."""


@dataclass(frozen=True)
class Estimate:
    """A parameter of an effect. low, high: its 95 % interval, SI."""

    name: str
    unit: str
    value: float
    low: float
    high: float


def deviations(fit: Fit, given: Sequence[int] = ()) -> tuple[Floats, Floats, Floats]:
    """Standard deviation of every parameter of all effects, that for white errors, and freedom.

    The last are degrees of freedom; (p,) each. From time segments: an effect that is visible in
    only one of four trials is no less significant. given: indices of parameters that are taken as
    known.
    """
    white, by_clustering = _variances(fit, given)
    variance, freedom = by_clustering[0]
    deviation, total_freedom = _with_placebo_inflation(
        fit.candidates, np.sqrt(variance), white, freedom
    )
    return deviation, np.sqrt(white), total_freedom


def half_widths_of(fit: Fit) -> Floats:
    """Half width of the 95 % interval of every parameter of all effects, (p,).

    The variation between trials has few degrees of freedom, so that its t quantile is large.
    """
    white, by_clustering = _variances(fit)
    half_widths = []
    for variance, freedom in by_clustering:
        deviation, total_freedom = _with_placebo_inflation(
            fit.candidates, np.sqrt(variance), white, freedom
        )
        half_widths.append(stats.t.ppf(0.5 + CONFIDENCE / 2, total_freedom) * deviation)
    return np.asarray(np.max(half_widths, axis=0))


def _variances(fit: Fit, given: Sequence[int] = ()) -> tuple[Floats, list[tuple[Floats, Floats]]]:
    """Variance of every parameter for white errors; robust variance and freedom by clustering.

    Clusters are time segments, and trials if there are enough of them. A shape that is not
    identifiable is taken as given: its deviation is that of its prior, and it does not inflate that
    of the size.
    """
    responses = fit.nuisances.project_out(fit.effect_columns)
    prior = np.concatenate([c.deviations for c in fit.candidates]) ** -2.0
    normal = responses.T @ responses + np.diag(prior)
    fixed = (prior == 1.0) & (np.diag(np.linalg.inv(normal)) > UNIDENTIFIABLE**2)
    fixed |= np.isin(np.arange(prior.size), given)
    normal[np.ix_(fixed, ~fixed)] = normal[np.ix_(~fixed, fixed)] = 0.0
    normal[np.ix_(fixed, fixed)] = np.eye(int(fixed.sum()))
    covariance: Floats = np.asarray(np.linalg.inv(normal), np.float64)
    responses = np.where(fixed, 0.0, responses)
    residual = fit.nuisances.projected_residuals(fit.whitened_residuals, coordinates_of(fit.point))
    residual = residual - responses @ np.linalg.solve(normal, responses.T @ residual)
    segments = fit.nuisances.clustered(fit.clusters)
    by_clustering = [_robust_variance(fit, responses, residual, covariance, segments)]
    if len(fit.model.records) >= FEW:
        trials = fit.nuisances.clustered(recordings(fit.model))
        by_clustering.append(_robust_variance(fit, responses, residual, covariance, trials))
    return np.diag(covariance), by_clustering


def _with_placebo_inflation(
    candidates: Sequence[Hypothesis], deviation: Floats, white: Floats, freedom: Floats
) -> tuple[Floats, Floats]:
    """Apply the variance inflation of placebo locations to effects that have any."""
    placebos = [(c.placebo, len(c.parameters)) for c in candidates]
    inflation = np.repeat(
        [e.inflation if e else 0.0 for e, _ in placebos], [n for _, n in placebos]
    )
    limits_of_freedom = np.repeat(
        [e.freedom if e else math.inf for e, _ in placebos], [n for _, n in placebos]
    )
    return np.maximum(deviation, np.sqrt(inflation * white)), np.minimum(freedom, limits_of_freedom)


def _robust_variance(
    fit: Fit, responses: Floats, residual: Floats, covariance: Floats, clusters: Integers
) -> tuple[Floats, Floats]:
    """Cluster-robust variance of every parameter and its degrees of freedom, (p,) each."""
    robust, _, freedom = cluster_variances(responses, residual, clusters)
    meat = np.sqrt(robust)
    sandwich = (
        covariance
        @ (meat[:, None] * _correlations(responses * residual[:, None], clusters) * meat)
        @ covariance
    )
    return fit.variance_inflation.moderated(np.diag(sandwich), np.diag(covariance), freedom)


def _correlations(products: Floats, clusters: Integers) -> Floats:
    """Correlations of the cluster sums of the parameters' scores, (p, p)."""
    sums = np.stack([np.bincount(clusters, p) for p in products.T], axis=1)
    norms = np.sqrt(np.sum(sums**2, axis=0)) + 1e-300
    return np.asarray((sums / norms).T @ (sums / norms))


def significance(fit: Fit, number: int) -> float:
    """One-sided p of the size of effect `number`, against negligible sizes.

    For an effect that the file states, of its difference from the stated size.

    Without the effect its shapes have no meaning, so that their errors do not enter that of the
    size: they are taken as fitted, and each counts as one more test. The size of a limit is
    significant wherever the limit is nearly reached, so for a limit the response is tested instead.
    """
    candidate = fit.candidates[number]
    assert isinstance(candidate, Candidate)
    if limits(candidate.kind):
        return min(1.0, _response_p(fit, number) * len(candidate.parameters))
    deviation, _, freedom = _of_size(fit, number)
    excess = abs(candidate.added) - candidate.negligible_difference
    return _one_sided(fit, number, excess / deviation, freedom)


def likelihood_ratio_p(fit: Fit, number: int, loss: float) -> float:
    """One-sided p of effect `number` by the log-likelihood that is lost without it, nats.

    The error of a size says what it costs to make it a little smaller. Where other parameters
    replace a small part of an effect and not the whole of it, the loss is far larger, and the size
    divided by its error tends to nothing (Hauck and Donner, Journal of the American Statistical
    Association 72 (1977)). The loss has the variance inflation of the size.
    """
    candidate = fit.candidates[number]
    assert isinstance(candidate, Candidate)
    if limits(candidate.kind):
        return 1.0
    deviation, white, freedom = _of_size(fit, number)
    share = max(1.0 - candidate.negligible_difference / max(abs(candidate.added), 1e-300), 0.0)
    return _one_sided(
        fit, number, share * math.sqrt(2.0 * max(loss, 0.0)) * white / deviation, freedom
    )


def _of_size(fit: Fit, number: int) -> tuple[float, float, float]:
    """Standard deviation of the size of an effect, that for white errors, degrees of freedom.

    The shapes of the effect are taken as known.
    """
    index = sum(len(c.parameters) for c in fit.candidates[:number])
    shape_indices = range(index + 1, index + len(fit.candidates[number].parameters))
    deviation, white, freedom = deviations(fit, shape_indices)
    return float(deviation[index]), float(white[index]), float(freedom[index])


def _one_sided(fit: Fit, number: int, root: float, freedom: float) -> float:
    """One-sided p of a size in standard deviations, corrected for the shapes of its effect."""
    candidate = fit.candidates[number]
    assert isinstance(candidate, Candidate)
    p = float(stats.t.sf(root, freedom))
    if candidate.kind.unseen_turn:
        p = _over_angles(p, len(fit.model.records))
    return min(1.0, p * len(candidate.parameters))


def _over_angles(p: float, count: int) -> float:
    """Return p of an amplitude at angles that were estimated in `count` recordings.

    Without an effect, the gain of a line at its best angle is exponential in each of them, in nats.
    """
    gain = 0.5 * max(float(stats.norm.isf(p)), 0.0) ** 2
    return float(special.gammaincc(count, gain))


def _response_p(fit: Fit, number: int) -> float:
    """One-sided p of the amplitude of the whole response of an effect."""
    effect, others = fit.point.effects[number], list(fit.point.effects)
    del others[number]
    without = replace(fit.point, effects=tuple(others))
    trace = change(fit.model, without, (*others, effect), predict(fit.model, without))
    response = fit.nuisances.project_out(whiten_and_stack(fit.model, fit.noise, trace))
    residual = (
        fit.nuisances.projected_residuals(fit.whitened_residuals, coordinates_of(fit.point))
        + response
    )
    return amplitude_p(
        response, residual, fit.nuisances.clustered(fit.clusters), fit.variance_inflation
    )


def estimates(fit: Fit, number: int) -> list[Estimate]:
    """Estimates of the parameters of effect `number`, with intervals; integers are exact."""
    half_widths = half_widths_of(fit)
    first = sum(len(c.parameters) for c in fit.candidates[:number])
    candidate = fit.candidates[number]
    if not isinstance(candidate, Candidate):
        return []
    fitted = [_estimate(candidate, 0, p, float(half_widths[first])) for p in sizes(candidate.kind)]
    for i, p in enumerate(shapes(candidate.kind), start=1):
        fitted.append(_estimate(candidate, i, p, float(half_widths[first + i])))
    effect = candidate.effect()
    names = {e.name for e in fitted}
    exact = [p for p in candidate.kind.parameters() if p.name not in names]
    return fitted + [
        Estimate(p.name, p.unit, v := float(getattr(effect, p.name)), v, v) for p in exact
    ]


def _formula_error(candidate: Candidate, parameter: int, p: Parameter) -> float:
    """Half width of a parameter by inexact formulas; 0 for a location or an angle."""
    if parameter == 0:
        return 0.0 if candidate.fixed_from_data else FORMULA_WIDTH * abs(candidate.size)
    return FORMULA_WIDTH / SHAPE if is_log_scaled(p, getattr(candidate.pattern, p.name)) else 0.0


def _estimate(candidate: Candidate, parameter: int, p: Parameter, half_width: float) -> Estimate:
    half_width = math.hypot(half_width, _formula_error(candidate, parameter, p))
    values = []
    for sign in (-1.0, 0.0, 1.0):
        parameters = list(candidate.parameters)
        parameters[parameter] += sign * half_width
        if parameter == 0 and parameters[0] * candidate.size <= 0.0:
            parameters[0] = 1e-3 * candidate.size
        shifted = replace(candidate, parameters=tuple(parameters)).effect()
        values.append(float(getattr(shifted, p.name)))
    low, value, high = values
    return Estimate(p.name, p.unit, value, min(low, high), max(low, high))
