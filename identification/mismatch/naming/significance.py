"""How certain an accepted effect must be, by what training and held-out recordings say together.

An effect that acts in few stretches of the training recordings has few to be told from, so that it
may explain hundreds of nats and not be certain. Held-out recordings, on which nothing was fitted,
are evidence of their own: there the effect has one amplitude, which is 1 if it is right. The two
are joined by Fisher's method ("Questions and answers #14", The American Statistician 2 (1948)).
That training recordings may tell alone, or both together, costs a factor of two.
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.held_out import CONFIRMED, refit_on
from slipbench.identification.mismatch.fit.sensitivity import change, coordinates_of
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.fit.variance_inflation import VarianceInflation, amplitude_p
from slipbench.identification.mismatch.naming.interval import significance
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.plant.errors import PlantError

CHOICES = 2
"""Ways of being certain: by the training recordings, or by both."""
DOUBTED = 0.01
"""p on the training recordings above which no others are asked."""


@dataclass(frozen=True, eq=False)
class SignificanceRule:
    """limit: p that whatever is accepted must stay below. held_out: recordings that join in."""

    limit: float
    held_out: Model | None = None

    def holds(self, fit: Fit, number: int) -> bool:
        """Tell whether effect `number` of a fit is certain."""
        return self.p(fit, number) < self.limit

    def p(self, fit: Fit, number: int) -> float:
        """One-sided p of an effect, over both ways of being certain."""
        told = significance(fit, number)
        if self.held_out is None:
            return told
        alone = CHOICES * told
        if alone < self.limit or told > DOUBTED:
            return min(1.0, alone)
        return min(
            1.0, alone, CHOICES * joined(told, predicted_held_out(fit, number, self.held_out))
        )


def joined(one: float, other: float) -> float:
    """p of two independent ones together, by Fisher's method; of what is not told (1) the other."""
    if other >= 1.0:
        return one
    product = one * other
    return product * (1.0 - math.log(product)) if product > 0.0 else 0.0


@lru_cache(maxsize=16)
def predicted_held_out(fit: Fit, number: int, held_out: Model) -> float:
    """One-sided p of an effect's amplitude on recordings that it was not fitted to.

    It is taken where the effect is left out, since p is of its not being there. 1 where they would
    not show it plainly, where they cannot be simulated with it, and where an angle was read off each
    of them.
    """
    found = fit.candidates[number]
    assert isinstance(found, Candidate)
    if found.kind.unseen_turn:
        return 1.0
    bare = refit_on(_without(fit, number), held_out)
    with_it = (*bare.point.effects, fit.point.effects[number])
    try:
        trace = change(bare.model, bare.point, with_it, bare.predicted)
    except PlantError:
        return 1.0
    course = bare.nuisances.project_out(whiten_and_stack(bare.model, bare.noise, trace))
    if 0.5 * float(course @ course) < CONFIRMED:
        return 1.0
    left = bare.nuisances.projected_residuals(bare.whitened_residuals, coordinates_of(bare.point))
    groups = bare.nuisances.clustered(bare.clusters)
    return amplitude_p(course, left, groups, _usual(bare, found.placebo))


def _without(fit: Fit, number: int) -> Fit:
    others = tuple(e for i, e in enumerate(fit.point.effects) if i != number)
    left = tuple(c for i, c in enumerate(fit.candidates) if i != number)
    return replace(fit, point=replace(fit.point, effects=others), candidates=left)


def _usual(fit: Fit, elsewhere: VarianceInflation | None) -> VarianceInflation:
    """What is usual for these residuals, or along the road where that is more."""
    if elsewhere is None:
        return fit.variance_inflation
    inflation = max(fit.variance_inflation.inflation, elsewhere.inflation)
    return replace(fit.variance_inflation, inflation=inflation)
