"""Stepwise search for missing effects, over sets of up to three.

Forward selection: the library is screened on the residual of the accepted effects, and the best of
the promising effects that passes the rule of acceptance is added; where parameters are far from
their priors, effects fitted from the values of the file are included. Swap step: the best next
effect need not belong to the best set, so with several effects each is removed in turn, the library
is screened again, and the effect is tested at its other locations. After a swap, forward selection
continues. Backward elimination: effects without a sufficient gain are removed. If a significant
residual remains, `ahead` tests pairs as one step. Finally, `predicting` removes effects that worsen
the held-out prediction.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from itertools import islice

import numpy as np

from slipbench.identification.mismatch.fit.calibrate import beyond_prior, far_from_prior
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.held_out import mispredicted
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.refit import refit_with_updated_jacobian
from slipbench.identification.mismatch.naming.acceptance import Acceptance
from slipbench.identification.mismatch.naming.fits import (
    beside_the_file,
    by_score,
    fits_from_the_file,
    fitted,
    fitted_without,
    moved,
    others_refined,
    promising_fits,
)
from slipbench.identification.mismatch.naming.look_ahead import (
    PROMISED,
    SECONDS,
    first_effects,
    pairs,
)
from slipbench.identification.mismatch.naming.named import Named, restricted_to
from slipbench.identification.mismatch.naming.plausibility import doubts, plausible_first
from slipbench.identification.mismatch.naming.score import (
    Score,
    at_other_places,
    by_log_likelihood_gain,
    scores,
    screen,
)
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.identification.mismatch.thresholds import DOUBTFUL, INDISTINGUISHABLE, REQUIRED_GAIN
from slipbench.plant.effects.effect import Effect

MOST = 3
CHANCES = 3  # number of passing fits that are tested on the held-out recordings
ROUNDS = 2  # of swap steps
ALIKE = 0.05
"""Prior deviations within which fits of the same effects are one."""

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Search:
    """A search over a library. held_out: recordings that can contradict an effect."""

    library: Sequence[type[Effect]]
    say: Say = lambda _: None
    held_out: Model | None = None

    def named(self, base: Fit) -> Named:
        """Find up to three effects that pass the rule of acceptance."""
        return self._refined(
            self._forward(Named(base, base, screen(Linearization.of(base), self.library)))
        )

    def ahead(self, named: Named, required_gain: float = REQUIRED_GAIN) -> Named:
        """Return the effects found from a step of two effects, if they explain more.

        required_gain: gain required of the two effects beyond the accepted ones, nats.
        """
        singles = first_effects(
            named, self.library, named.log_likelihood_gain + required_gain, self.say
        )
        named = replace(named, screenings=named.screenings + 1 + len(singles))
        required = max(
            [named.fit.score + required_gain, *(f.score + REQUIRED_GAIN for f in singles)]
        )
        fits = [*singles, *pairs(named, singles, self.library, required)]
        enough = named.fit.score + REQUIRED_GAIN
        if all(f.score <= enough and _subset(f, named) for f in _leading(fits)):
            return named
        without_effects = replace(named, fit=named.base, competing={}, doubts={}, found_in={})
        step = self._step(without_effects, fits, rejected=[])
        if _subset(step.fit, named) and step.fit.score <= enough:
            return replace(named, vetoes=step.vetoes)  # the step leads to the same effects
        refined = self._refined(self._forward(step))
        if refined.names and refined.fit.score > enough:
            return refined
        return replace(named, vetoes=refined.vetoes)

    def predicting(self, named: Named) -> Named:
        """Remove effects, the last first, with which held-out recordings are predicted worse.

        During the search all parameters are free on the held-out recordings. The simulation that is
        written has those of the training recordings. The remaining effects are significant.
        """
        while self.held_out is not None and named.names:
            last = len(named.names) - 1
            contradiction = mispredicted(self.held_out, named.base, named.fit, REQUIRED_GAIN)
            if contradiction is None:
                break
            others = fitted_without(named.fit, last) if last else None
            reduced = replace(
                restricted_to(named, others or named.base), vetoes=(*named.vetoes, contradiction)
            )
            named = pruned(reduced, self._rule(reduced), self.say)
        return named

    def _forward(self, named: Named) -> Named:
        """Add one effect after the other while one passes."""
        while len(named.names) < MOST:
            rough = named.fit.coarse
            if named.names:
                named = replace(named, screenings=named.screenings + 1)
            screened = self._screened(named, named.fit) if named.names else named.scores
            fits = promising_fits(rough, screened, self.say)
            rejected: list[Fit] = []
            step = self._step(named, fits, rejected)
            if step.names == named.names or not named.names:
                named, fits, step = self._beside_the_file(named, fits, step, rejected)
            if step.names == named.names and (others := others_refined(rough, _simulated(fits))):
                step = self._step(_with_tests_of(named, step), [*fits, *others], rejected)
            if len(step.names) == len(named.names):
                return step
            named = step
        return named

    def _step(self, named: Named, fits: Sequence[Fit], rejected: list[Fit]) -> Named:
        """Accept the first candidate fit that passes, the most plausible of ties first.

        rejected: fits that did not pass with fine steps or on held-out recordings, beside the same
        accepted effects; they are not tried again, and receive those of this step.
        """
        rough, rule = named.fit.coarse, self._rule(named)
        by_rank = by_score(fits)
        accepts = cache(partial(rule.accepts, rough))
        untried = (f for f in by_rank if not any(_same_finding(r, f) for r in rejected))
        passed = filter(accepts, untried)
        vetoes, p = list(named.vetoes), named.p
        for new in islice(
            plausible_first(passed, len(rough.candidates), INDISTINGUISHABLE),
            CHANCES - len(rejected),
        ):
            finer = _finer(named, new, filter(accepts, _ties(new, by_rank)))
            if not rule.accepts(named.fit, finer):
                rejected.append(new)
                continue
            contradiction = rule.veto(named.fit, finer)
            if contradiction is None:
                return self._with(replace(named, vetoes=tuple(vetoes)), new, finer, by_rank)
            rejected.append(new)
            vetoes.append(contradiction)
            p = min(p, DOUBTFUL * min(rule.ps(finer)))
        if not any(map(accepts, by_rank)):
            p = min((rule.p(rough, t) for t in by_rank), default=1.0)
        return replace(named, vetoes=tuple(vetoes), p=p)

    def _with(self, named: Named, new: Fit, finer: Fit, fits: Sequence[Fit]) -> Named:
        """Return the state with the effects of a fit, and the competing fits of this step."""
        added = [c.name for c in new.candidates if c.name not in named.names]
        joined = " + ".join(added)
        nats = finer.score - named.fit.score
        self.say(f"Accepted: {joined} (log-likelihood gain {nats:.0f} nats)")
        competing = {**named.competing, joined: _deficits(new, fits)}
        all_doubts = named.doubts | _doubts(named.fit, [new, *fits])
        found_in = named.found_in | dict.fromkeys(added, named.screenings)
        return replace(named, fit=finer, competing=competing, doubts=all_doubts, found_in=found_in)

    def _refined(self, named: Named) -> Named:
        """Swap effects, continue forward selection after a swap, then eliminate backward."""
        for _ in range(ROUNDS if len(named.names) > 1 else 0):
            before, named = named.names, self.exchanged(named)
            if named.names == before:
                break
            named = self._forward(named)
        return pruned(named, self._rule(named), self.say)

    def exchanged(self, named: Named) -> Named:
        """Replace one effect by another where that gains ENOUGH nats more."""
        before = named.fit
        for name in named.names:
            self.say(f"Testing replacements of {name}".replace("_", " "))
        swapped_fits = in_threads(lambda i: list(self._swapped(named, i)), range(len(named.names)))
        named = replace(named, screenings=named.screenings + len(named.names))
        rule = self._rule(named)
        for new in by_score(f for fits in swapped_fits for f in fits):
            if new.score < before.score + REQUIRED_GAIN:
                break
            if not rule.all_significant(new):
                continue
            contradiction = rule.veto(named.base, new)
            if contradiction is None:
                return self._renamed(named, new)
            named = replace(named, vetoes=(*named.vetoes, contradiction))
        return named

    def _swapped(self, named: Named, i: int) -> Iterator[Fit]:
        """Yield fits with other effects in the place of one, or with it at another location."""
        fit = named.fit
        removed, without = fit.effects[i], fitted_without(fit, i)
        if without is None:
            return
        others = [s for s in self._screened(named, without) if s.candidate.name != removed.name]
        for score in others[:SECONDS]:
            enough = (
                without.score + PROMISED * score.log_likelihood_gain > fit.score + REQUIRED_GAIN
            )
            new = fitted(without, score.candidate) if enough else None
            if new is not None:
                yield new
        relocated = list(at_other_places(removed, self.library, fit.model))
        for score in by_log_likelihood_gain(scores(Linearization.of(without), relocated))[:SECONDS]:
            new = moved(without, fit, i, score.candidate)
            if new is not None:
                yield new

    def _renamed(self, named: Named, new: Fit) -> Named:
        """Return the state with the effects of a swapped fit; others keep their competitors."""
        names = [c.name for c in new.candidates]
        removed = next(n for n in named.names if n not in names)
        added = names[-1]
        gain = new.score - named.fit.score
        self.say(f"Replaced: {removed} by {added} (log-likelihood gain {gain:.0f} nats)")
        kept = {n: r for n, r in named.competing.items() if removed not in n.split(" + ")}
        found_in = {n: k for n, k in named.found_in.items() if n != removed} | {
            added: named.screenings
        }
        return replace(
            named, fit=new, competing={**kept, added: {removed: gain}}, found_in=found_in
        )

    def _screened(self, named: Named, fit: Fit) -> list[Score]:
        return screen(Linearization.of(fit), self.library, named.first).scores

    def _beside_the_file(
        self, named: Named, fits: list[Fit], step: Named, rejected: list[Fit]
    ) -> tuple[Named, list[Fit], Named]:
        """Return state, fits and step with effects fitted from the file, if these are as good.

        Only where parameters are far from it after that step. fits: promising ones; step: what
        follows from them alone; rejected: see `_step`.
        """
        if not far_from_prior(step.fit):
            return named, fits, step
        rough, found = named.fit.coarse, step.names != named.names
        required = step.fit.score - INDISTINGUISHABLE if found else rough.score + REQUIRED_GAIN
        from_file = fits_from_the_file(rough, self.library, self.say, named.first, required)
        if all(f.score < required or _same_finding(step.fit, f) for f in from_file):
            return named, fits, step
        named = replace(named, screenings=named.screenings + 1)
        fits = [*fits, *from_file]
        return named, fits, self._step(_with_tests_of(named, step), fits, rejected)

    def _rule(self, named: Named) -> Acceptance:
        return Acceptance(named.first.tests, self.held_out, named.screenings, named.found_in)


def _finer(named: Named, new: Fit, same: Iterable[Fit]) -> Fit:
    """Return the best fit with fine steps among accepted ones with the same effects.

    Several starts converge to several sizes where a sensor quantizes; coarse steps cannot determine
    the best. If calibration without the effects ended far from the prior, a start at the values of
    the file is included.
    """
    candidates = list(same)
    if beyond_prior(named.base):
        candidates += [f for f in (beside_the_file(new),) if f is not None]
    return max(
        (refit_with_updated_jacobian(f.fine(named.fit.model)) for f in _different(candidates)),
        key=lambda f: f.score,
    )


def _ties(new: Fit, fits: Iterable[Fit]) -> list[Fit]:
    """Return the fits with the same effects and nearly the same score."""
    return [
        f for f in fits if abs(f.score - new.score) < INDISTINGUISHABLE and _names(f) == _names(new)
    ]


def _names(fit: Fit) -> set[str]:
    return {c.name for c in fit.candidates}


def _with_tests_of(named: Named, step: Named) -> Named:
    """Return the state before a step, with the vetoes and the p that the step gave."""
    return replace(named, vetoes=step.vetoes, p=step.p)


def _subset(fit: Fit, named: Named) -> bool:
    """Return whether all effects of a fit are accepted ones."""
    return _names(fit) <= set(named.names)


def _leading(fits: Sequence[Fit]) -> list[Fit]:
    """Return the best fit, and those that are indistinguishable from it."""
    best = max((f.score for f in fits), default=0.0)
    return [f for f in fits if f.score > best - INDISTINGUISHABLE]


def _same_finding(known: Fit, new: Fit) -> bool:
    """Return whether a fit has the same effects as a known one, and is not clearly better."""
    return _names(known) == _names(new) and new.score < known.score + INDISTINGUISHABLE


def _different(fits: Sequence[Fit]) -> list[Fit]:
    """Return fits with the same effects that differ from each other, best first."""
    kept: list[Fit] = []
    for fit in by_score(fits):
        if not any(_alike(fit, other) for other in kept):
            kept.append(fit)
    return kept


def _alike(one: Fit, other: Fit) -> bool:
    """Return whether two fits with the same effects have nearly the same parameters."""
    effects = {c.name: c for c in other.effects}
    return bool(np.all(np.abs(one.point.x - other.point.x) < ALIKE)) and all(
        c.pattern == effects[c.name].pattern
        and np.all(
            np.abs(np.subtract(c.parameters, effects[c.name].parameters))
            < ALIKE * np.array(c.deviations)
        )
        for c in one.effects
    )


def _simulated(fits: Sequence[Fit]) -> list[Fit]:
    """Return the fits whose last effect acts in the simulation, not in a sensor alone.

    Updated sensitivities of the system do not change the response of a sensor.
    """
    return [f for f in fits if not f.model.changes_only_sensors(f.point.effects[-1])]


def pruned(named: Named, rule: Acceptance, say: Say) -> Named:
    """Backward elimination: remove effects of insufficient gain or significance, one at a time.

    Removing one effect can make others insignificant; then another one is removed first, if
    possible.
    """
    fit = named.fit
    losses = lost_without(named.base, fit)
    nats = [n for n, _ in losses]
    order = sorted(range(len(losses)), key=lambda i: nats[i])
    removable = [i for i in order if not rule.keeps(fit, i, nats)]
    if not removable:
        return replace(named, p=min([named.p, *rule.ps(fit)]))
    harmless = [i for i in removable if rule.all_significant(losses[i][1])]
    first = harmless[0] if harmless else removable[0]
    say(f"Removed by backward elimination: {fit.candidates[first].name}")
    others = losses[first][1]
    competing = named.competing if others.candidates else {}
    return pruned(replace(named, fit=others, competing=competing), rule, say)


def lost_without(base: Fit, fit: Fit) -> list[tuple[float, Fit]]:
    """Return for each effect the loss without it, nats, and the fit of the others.

    Where the others cannot be simulated alone the loss is infinite, and the fit is the base.
    """
    count = len(fit.candidates)
    if count == 1:
        return [(fit.score - base.score, base)]
    reduced_fits = in_threads(lambda i: fitted_without(fit, i), range(count))
    return [(math.inf, base) if w is None else (fit.score - w.score, w) for w in reduced_fits]


def _deficits(best: Fit, fits: Iterable[Fit]) -> dict[str, float]:
    """Deficits to the best fit, nats, of each other effect at its best. fits: best first."""
    deficits: dict[str, float] = {}
    for fit in fits:
        name = fit.candidates[-1].name
        if name != best.candidates[-1].name:
            deficits.setdefault(name, best.score - fit.score)
    return deficits


def _doubts(fit: Fit, fits: Sequence[Fit]) -> dict[str, str]:
    """Prior reasons against effects that were fitted in addition to those of a fit."""
    added = {c.name: (c, t) for t in fits for c in t.effects[len(fit.candidates) :]}
    priors_of = {name: doubts(c, t) for name, (c, t) in added.items()}
    return {name: priors[0].reason for name, priors in priors_of.items() if priors}
