"""Significance of an accepted effect from training and held-out recordings together.

An effect that acts in few time segments of the training recordings has few degrees of freedom, so
that it may gain hundreds of nats and not be significant. Held-out recordings, on which nothing was
fitted, are independent evidence: there the effect has one amplitude, which is 1 if it is right. The
two are combined by Fisher's method ("Questions and answers #14", The American Statistician 2
(1948)). Using the training recordings alone or both together is a choice of two tests, which costs
a factor of two.
"""

import math
from dataclasses import dataclass, replace

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.held_out import refit_on
from slipbench.identification.mismatch.fit.sensitivity import change, coordinates_of
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.fit.variance_inflation import VarianceInflation, amplitude_p
from slipbench.identification.mismatch.naming.fits import fitted_without
from slipbench.identification.mismatch.naming.interval import likelihood_ratio_p, significance
from slipbench.identification.mismatch.simulation.kept import last_results
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.thresholds import CONFIRMED, JOINT_TEST_P
from slipbench.plant.errors import PlantError

CHOICES = 2
"""Number of tests: by the training recordings, or by both."""


@dataclass(frozen=True, eq=False)
class SignificanceRule:
    """limit: p that accepted effects must stay below. held_out: recordings, if used."""

    limit: float
    held_out: Model | None = None

    def holds(self, fit: Fit, number: int, without: Fit | None = None) -> bool:
        """Return whether effect `number` of a fit is significant. without: as for `p`."""
        return self.p(fit, number, without) < self.limit

    def may_hold(self, fit: Fit, number: int) -> bool:
        """Return whether an effect can be significant, by its size alone; this needs no fit."""
        return significance(fit, number) <= max(self.limit, JOINT_TEST_P)

    def p(self, fit: Fit, number: int, without: Fit | None = None) -> float:
        """One-sided p of an effect, corrected for both tests.

        without: the fit of all else, where it is known.
        """
        training = significance(fit, number)
        if self.limit <= training <= JOINT_TEST_P:
            training = min(training, p_of_loss(fit, number, without))
        if self.held_out is None:
            return training
        alone = CHOICES * training
        if alone < self.limit or training > JOINT_TEST_P:
            return min(1.0, alone)
        predicted = predicted_held_out(fit, number, self.held_out, without)
        return min(1.0, alone, CHOICES * joined(training, predicted))


def p_of_loss(fit: Fit, number: int, known: Fit | None = None) -> float:
    """One-sided p of an effect by what is lost if all else is fitted without it.

    1 where nothing can be simulated without it: then its size alone counts. known: the fit without
    it.
    """
    without = known or fitted_without(fit, number)
    return 1.0 if without is None else likelihood_ratio_p(fit, number, fit.score - without.score)


def joined(one: float, other: float) -> float:
    """Combined p of two independent ones by Fisher's method; `one` if the other is 1."""
    if other >= 1.0:
        return one
    product = one * other
    return product * (1.0 - math.log(product)) if product > 0.0 else 0.0


@last_results(16)
def predicted_held_out(fit: Fit, number: int, held_out: Model, known: Fit | None = None) -> float:
    """One-sided p of an effect's amplitude on recordings that it was not fitted to.

    It is computed at the fit without the effect, since p assumes its absence. 1 if the expected
    gain is below CONFIRMED, if they cannot be simulated with it, or if a crank phase was estimated
    in each of them. known: the fit without it, of the training recordings.
    """
    candidate = fit.candidates[number]
    assert isinstance(candidate, Candidate)
    if candidate.kind.unseen_turn:
        return 1.0
    without = refit_on(known or _without(fit, number), held_out)
    effects = (*without.point.effects, fit.point.effects[number])
    try:
        trace = change(without.model, without.point, effects, without.predicted)
    except PlantError:
        return 1.0
    response = without.nuisances.project_out(whiten_and_stack(without.model, without.noise, trace))
    if 0.5 * float(response @ response) < CONFIRMED:
        return 1.0
    residual = without.nuisances.projected_residuals(
        without.whitened_residuals, coordinates_of(without.point)
    )
    clusters = without.nuisances.clustered(without.clusters)
    return amplitude_p(response, residual, clusters, _inflation_of(without, candidate.placebo))


def _without(fit: Fit, number: int) -> Fit:
    others = tuple(e for i, e in enumerate(fit.point.effects) if i != number)
    candidates = tuple(c for i, c in enumerate(fit.candidates) if i != number)
    return replace(fit, point=replace(fit.point, effects=others), candidates=candidates)


def _inflation_of(fit: Fit, placebo: VarianceInflation | None) -> VarianceInflation:
    """Variance inflation of these residuals, or of the placebo locations if larger."""
    if placebo is None:
        return fit.variance_inflation
    inflation = max(fit.variance_inflation.inflation, placebo.inflation)
    return replace(fit.variance_inflation, inflation=inflation)
