"""How well the effects' parameters are known: errors may hang together within stretches of time."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import special, stats

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.sensitivity import change, coordinates_of
from slipbench.identification.mismatch.fit.sizing import SHAPE, by_factors, limits, shapes, sizes
from slipbench.identification.mismatch.fit.stack import Integers, recordings, whiten_and_stack
from slipbench.identification.mismatch.fit.variance_inflation import amplitude_p, stretches
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.plant.parameters import Parameter
from slipbench.plant.signals import Floats

CONFIDENCE = 0.95
FEW = 3
"""Recordings from which on what differs from one trial to the next is told as well."""
IDEAL = 0.02
"""Share of a parameter within which two formulas of one physics mean the same by it, 95 %.

Where recordings tell more than that, formulas do not: of 42 numbers that two proofs told of (their
generator has formulas of its own), 12 were off by more than recordings allow, 10 of them by less
than 3 %.
"""
UNTOLD = 0.7
"""Posterior deviation of a shape, in prior ones, above which nothing was told of it."""


@dataclass(frozen=True)
class Estimate:
    """A parameter of an effect. low, high: its 95 % interval, SI."""

    name: str
    unit: str
    value: float
    low: float
    high: float


def deviations(fit: Fit, given: Sequence[int] = ()) -> tuple[Floats, Floats]:
    """Standard deviation of every dial of all effects, and its degrees of freedom.

    As stretches of time tell it: an effect that one trial shows and three do not is no less there.
    given: dials that are taken as they are.
    """
    white, told = _told(fit, given)
    variance, freedom = told[0]
    return _as_elsewhere(fit.candidates, np.sqrt(variance), white, freedom)


def reaches(fit: Fit) -> Floats:
    """Half width of the 95 % interval of every dial of all effects.

    What differs from trial to trial is told by few trials, so that their t is a wide one.
    """
    white, told = _told(fit)
    found = []
    for variance, freedom in told:
        spread, count = _as_elsewhere(fit.candidates, np.sqrt(variance), white, freedom)
        found.append(stats.t.ppf(0.5 + CONFIDENCE / 2, count) * spread)
    return np.asarray(np.max(found, axis=0))


def _told(fit: Fit, given: Sequence[int] = ()) -> tuple[Floats, list[tuple[Floats, Floats]]]:
    """Variance of every dial if errors were white; variance and freedom as groups of them tell it.

    Groups: stretches of time, and where there are enough of them trials. A shape of which the
    recordings tell nothing is taken as given: its deviation is its prior's, and it does not blur
    the size.
    """
    off = fit.nuisances.project_out(fit.effect_columns)
    prior = np.concatenate([c.deviations for c in fit.candidates]) ** -2.0
    normal = off.T @ off + np.diag(prior)
    untold = (prior == 1.0) & (np.diag(np.linalg.inv(normal)) > UNTOLD**2)
    untold |= np.isin(np.arange(prior.size), given)
    normal[np.ix_(untold, ~untold)] = normal[np.ix_(~untold, untold)] = 0.0
    normal[np.ix_(untold, untold)] = np.eye(int(untold.sum()))
    covariance: Floats = np.asarray(np.linalg.inv(normal), np.float64)
    off = np.where(untold, 0.0, off)
    left = fit.nuisances.projected_residuals(fit.whitened_residuals, coordinates_of(fit.point))
    left = left - off @ np.linalg.solve(normal, off.T @ left)
    groups = fit.nuisances.clustered(fit.clusters)
    told = [_spread(fit, off, left, covariance, groups)]
    if len(fit.model.records) >= FEW:
        trials = fit.nuisances.clustered(recordings(fit.model))
        told.append(_spread(fit, off, left, covariance, trials))
    return np.diag(covariance), told


def _as_elsewhere(
    candidates: Sequence[Hypothesis], deviation: Floats, white: Floats, freedom: Floats
) -> tuple[Floats, Floats]:
    """Hold what is looked for along the road to how its size scatters over all the other places."""
    known = [(c.placebo, len(c.parameters)) for c in candidates]
    usual = np.repeat([e.inflation if e else 0.0 for e, _ in known], [n for _, n in known])
    told = np.repeat([e.freedom if e else math.inf for e, _ in known], [n for _, n in known])
    return np.maximum(deviation, np.sqrt(usual * white)), np.minimum(freedom, told)


def _spread(
    fit: Fit, off: Floats, left: Floats, covariance: Floats, groups: Integers
) -> tuple[Floats, Floats]:
    """Variance of every dial and its degrees of freedom; errors hang together within groups."""
    robust, _, freedom = stretches(off, left, groups)
    meat = np.sqrt(robust)
    told = covariance @ (meat[:, None] * _alike(off * left[:, None], groups) * meat) @ covariance
    return fit.variance_inflation.moderated(np.diag(told), np.diag(covariance), freedom)


def _alike(pushes: Floats, groups: Integers) -> Floats:
    """How far the pushes of two dials go together over groups: correlations."""
    push = np.stack([np.bincount(groups, p) for p in pushes.T], axis=1)
    size = np.sqrt(np.sum(push**2, axis=0)) + 1e-300
    return np.asarray((push / size).T @ (push / size))


def significance(fit: Fit, number: int) -> float:
    """One-sided p of the size of effect `number`, against sizes so small that they do not count.

    Of an effect that the file has already it is that of what differs from the file.

    Where there is no effect its shapes mean nothing, so that their errors are none of the size's:
    they are taken as fitted, and each counts as one more try. The size of a limit is certain
    wherever something comes near to it, so of a limit it is asked whether it does anything.
    """
    place = sum(len(c.parameters) for c in fit.candidates[:number])
    now = fit.candidates[number]
    assert isinstance(now, Candidate)
    if limits(now.kind):
        return min(1.0, _of_what_it_does(fit, number) * len(now.parameters))
    own = range(place + 1, place + len(now.parameters))
    spread, freedom = deviations(fit, own)
    beyond = abs(now.added) - now.negligible_difference
    p = float(stats.t.sf(beyond / spread[place], freedom[place]))
    if now.kind.unseen_turn:
        p = _over_angles(p, len(fit.model.records))
    return min(1.0, p * len(now.parameters))


def _over_angles(p: float, count: int) -> float:
    """Return p of an amplitude at angles that were read off so many recordings, each at its best.

    Where there is nothing, the nats of a line at its best angle are exponential in each of them.
    """
    nats = 0.5 * max(float(stats.norm.isf(p)), 0.0) ** 2
    return float(special.gammaincc(count, nats))


def _of_what_it_does(fit: Fit, number: int) -> float:
    """One-sided p of the amplitude of all that an effect changes."""
    it, others = fit.point.effects[number], list(fit.point.effects)
    del others[number]
    bare = replace(fit.point, effects=tuple(others))
    trace = change(fit.model, bare, (*others, it), predict(fit.model, bare))
    course = fit.nuisances.project_out(whiten_and_stack(fit.model, fit.noise, trace))
    left = (
        fit.nuisances.projected_residuals(fit.whitened_residuals, coordinates_of(fit.point))
        + course
    )
    return amplitude_p(course, left, fit.nuisances.clustered(fit.clusters), fit.variance_inflation)


def estimates(fit: Fit, number: int) -> list[Estimate]:
    """Parameters of effect `number` with their intervals; whole ones are as they are."""
    reach = reaches(fit)
    place = sum(len(c.parameters) for c in fit.candidates[:number])
    candidate = fit.candidates[number]
    if not isinstance(candidate, Candidate):
        return []
    found = [_estimate(candidate, 0, p, float(reach[place])) for p in sizes(candidate.kind)]
    for i, p in enumerate(shapes(candidate.kind), start=1):
        found.append(_estimate(candidate, i, p, float(reach[place + i])))
    effect = candidate.effect()
    named = {e.name for e in found}
    exact = [p for p in candidate.kind.parameters() if p.name not in named]
    return found + [
        Estimate(p.name, p.unit, v := float(getattr(effect, p.name)), v, v) for p in exact
    ]


def _ideal(candidate: Candidate, parameter: int, p: Parameter) -> float:
    """How far a dial goes within what formulas leave; nothing where it is a place or an angle."""
    if parameter == 0:
        return 0.0 if candidate.fixed_from_data else IDEAL * abs(candidate.size)
    return IDEAL / SHAPE if by_factors(p, getattr(candidate.pattern, p.name)) else 0.0


def _estimate(candidate: Candidate, parameter: int, p: Parameter, reach: float) -> Estimate:
    reach = math.hypot(reach, _ideal(candidate, parameter, p))
    ends = []
    for sign in (-1.0, 0.0, 1.0):
        parameters = list(candidate.parameters)
        parameters[parameter] += sign * reach
        if parameter == 0 and parameters[0] * candidate.size <= 0.0:
            parameters[0] = 1e-3 * candidate.size
        there = replace(candidate, parameters=tuple(parameters)).effect()
        ends.append(float(getattr(there, p.name)))
    low, value, high = ends
    return Estimate(p.name, p.unit, value, min(low, high), max(low, high))
