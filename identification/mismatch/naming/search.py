"""Name what is missing: a stepwise search over sets of up to three effects.

Forward: the library is screened on what the accepted effects leave, and the best of the promising
effects that passes the rule of acceptance is added; where parameters are far from their priors,
those that lead from the numbers of the file are among them. Exchange: the best next step need not
be on the best way, so where there are several, each is taken out in turn, the library is screened
again, and the effect is tried at its other places. What an exchange leaves over is looked for
again. Backward: what is not missed goes again. Where that leaves something unexplained, `ahead`
tries pairs as one step. Last, `predicting` drops names with which the simulation predicts worse.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

from slipbench.identification.mismatch.fit.calibrate import beyond_prior, parameters_far_from_prior
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.following import refit_with_updated_jacobian
from slipbench.identification.mismatch.fit.held_out import mispredicted
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.naming.acceptance import ENOUGH, Acceptance
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
from slipbench.identification.mismatch.naming.look_ahead import PROMISED, SECONDS, halves, pairs
from slipbench.identification.mismatch.naming.named import ALIKE, Named, left
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
from slipbench.plant.effects.effect import Effect

MOST = 3
CHANCES = 3  # of those that pass, how many are held against the held-out recordings
ROUNDS = 2  # of exchanges

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Search:
    """Where and how to search. held_out: recordings that can contradict a name."""

    library: Sequence[type[Effect]]
    say: Say = lambda _: None
    held_out: Model | None = None

    def named(self, base: Fit) -> Named:
        """Find up to three effects that pass the rule of acceptance."""
        return self._refined(
            self._forward(Named(base, base, screen(Linearization.of(base), self.library)))
        )

    def ahead(self, named: Named, least: float = ENOUGH) -> Named:
        """Return names to which a step of two effects leads, where they explain more.

        least: nats that the two must bring beyond what is named.
        """
        begun = halves(named, self.library, named.log_likelihood_gain + least, self.say)
        named = replace(named, screenings=named.screenings + 1 + len(begun))
        enough = max([named.fit.score + least, *(f.score + ENOUGH for f in begun)])
        bare = replace(named, fit=named.base, competing={}, doubts={}, found_in={})
        step = self._step(bare, [*begun, *pairs(named, begun, self.library, enough)])
        if set(step.names) <= set(named.names) and step.fit.score <= named.fit.score:
            return replace(named, vetoes=step.vetoes)  # it leads where the search was already
        found = self._refined(self._forward(step))
        if found.names and found.fit.score > named.fit.score + ENOUGH:
            return found
        return replace(named, vetoes=found.vetoes)

    def predicting(self, named: Named) -> Named:
        """Drop names, the last one first, with which held-out recordings are predicted worse.

        While names are searched for, all parameters may move again on the held-out recordings. The
        simulation that is written has those of the training recordings. What stays is certain.
        """
        while self.held_out is not None and named.names:
            last = len(named.names) - 1
            lost = mispredicted(self.held_out, named.base, named.fit, ENOUGH)
            if lost is None:
                break
            rest = fitted_without(named.fit, last) if last else None
            fewer = replace(left(named, rest or named.base), vetoes=(*named.vetoes, lost))
            named = pruned(fewer, self._rule(fewer), self.say)
        return named

    def _forward(self, named: Named) -> Named:
        """Add one effect after the other, as long as one passes."""
        while len(named.names) < MOST:
            rough = named.fit.coarse
            if named.names:
                named = replace(named, screenings=named.screenings + 1)
            found = self._screened(named, named.fit) if named.names else named.scores
            tried = promising_fits(rough, found, self.say)
            again = self._from_the_file(named) if _newly_far(named) else []
            named = replace(named, screenings=named.screenings + bool(again))
            step = self._step(named, [*tried, *again])
            if len(step.names) == len(named.names) and (others := others_refined(rough, tried)):
                step = self._step(named, [*tried, *again, *others])
            if len(step.names) == len(named.names):
                return step
            named = step
        return named

    def _step(self, named: Named, tried: Sequence[Fit]) -> Named:
        """Accept the first of what was tried that passes, the most plausible of ties first."""
        rough, rule = named.fit.coarse, self._rule(named)
        done = by_score(tried)
        passed = [t for t in done if rule.accepts(rough, t)]
        vetoes = list(named.vetoes)
        for new in plausible_first(passed, len(rough.candidates), ALIKE)[:CHANCES]:
            finer = _finer(named, new, passed)
            if not rule.accepts(named.fit, finer):
                continue
            against = rule.veto(named.fit, finer)
            if against is None:
                return self._with(replace(named, vetoes=tuple(vetoes)), new, finer, done)
            vetoes.append(against)
        p = named.p if passed else min((rule.p(rough, t) for t in done), default=1.0)
        return replace(named, vetoes=tuple(vetoes), p=p)

    def _with(self, named: Named, new: Fit, finer: Fit, tried: Sequence[Fit]) -> Named:
        """Return the names with those of a fit, and what comes near to it as it was tried."""
        come = [c.name for c in new.candidates if c.name not in named.names]
        news = " + ".join(come)
        nats = finer.score - named.fit.score
        self.say(f"Accepted: {news} (log-likelihood gain {nats:.0f} nats)")
        rivals = {**named.competing, news: _behind(new, tried)}
        doubtful = named.doubts | _doubts(named.fit, [new, *tried])
        found = named.found_in | dict.fromkeys(come, named.screenings)
        return replace(named, fit=finer, competing=rivals, doubts=doubtful, found_in=found)

    def _refined(self, named: Named) -> Named:
        """Exchange what something else explains better, go on from there, drop what is not missed."""
        for _ in range(ROUNDS if len(named.names) > 1 else 0):
            before, named = named.names, self.exchanged(named)
            if named.names == before:
                break
            named = self._forward(named)
        return pruned(named, self._rule(named), self.say)

    def exchanged(self, named: Named) -> Named:
        """Put another effect in the place of one where that brings ENOUGH nats more."""
        old = named.fit
        for gone in named.names:
            self.say(f"Testing replacements of {gone}".replace("_", " "))
        several = in_threads(lambda i: list(self._without(named, i)), range(len(named.names)))
        named = replace(named, screenings=named.screenings + len(named.names))
        rule = self._rule(named)
        for new in by_score(f for fits in several for f in fits):
            if new.score < old.score + ENOUGH:
                break
            if not rule.all_significant(new):
                continue
            against = rule.veto(named.base, new)
            if against is None:
                return self._renamed(named, new)
            named = replace(named, vetoes=(*named.vetoes, against))
        return named

    def _without(self, named: Named, i: int) -> Iterator[Fit]:
        """Yield fits with other effects in the place of one, or with it at another place."""
        fit = named.fit
        gone, rest = fit.effects[i], fitted_without(fit, i)
        if rest is None:
            return
        others = [s for s in self._screened(named, rest) if s.candidate.name != gone.name]
        for score in others[:SECONDS]:
            enough = rest.score + PROMISED * score.log_likelihood_gain > fit.score + ENOUGH
            new = fitted(rest, score.candidate) if enough else None
            if new is not None:
                yield new
        places = list(at_other_places(gone, self.library, fit.model))
        for score in by_log_likelihood_gain(scores(Linearization.of(rest), places))[:SECONDS]:
            new = moved(named.base, fit, i, score.candidate)
            if new is not None:
                yield new

    def _renamed(self, named: Named, new: Fit) -> Named:
        """Return the names of the new fit; rivals of those that stay are kept."""
        names = [c.name for c in new.candidates]
        gone = next(n for n in named.names if n not in names)
        come = names[-1]
        nats = new.score - named.fit.score
        self.say(f"Replaced: {gone} by {come} (log-likelihood gain {nats:.0f} nats)")
        kept = {n: r for n, r in named.competing.items() if gone not in n.split(" + ")}
        found = {n: k for n, k in named.found_in.items() if n != gone} | {come: named.screenings}
        return replace(named, fit=new, competing={**kept, come: {gone: nats}}, found_in=found)

    def _screened(self, named: Named, fit: Fit) -> list[Score]:
        return screen(Linearization.of(fit), self.library, named.first).scores

    def _from_the_file(self, named: Named) -> list[Fit]:
        return fits_from_the_file(named.fit.coarse, self.library, self.say, named.first)

    def _rule(self, named: Named) -> Acceptance:
        return Acceptance(named.first.tests, self.held_out, named.screenings, named.found_in)


def _finer(named: Named, new: Fit, passed: Sequence[Fit]) -> Fit:
    """Return the fit with fine steps, the best of those with the same effects.

    Several starts end at several sizes where a sensor rounds; coarse steps cannot tell which is best.
    Where calibration without the effects went far, they start beside the numbers of the file as well.
    """
    names = {c.name for c in new.candidates}
    same = [f for f in passed if {c.name for c in f.candidates} == names]
    near = [f for f in same if abs(f.score - new.score) < ALIKE]
    if beyond_prior(named.base):
        near += [f for f in (beside_the_file(new),) if f is not None]
    return max(
        (refit_with_updated_jacobian(f.fine(named.fit.model)) for f in near), key=lambda f: f.score
    )


def _newly_far(named: Named) -> bool:
    """Tell whether a number is far from the file that was not fixed there yet.

    What takes the place of those that were far already has been fitted in the first step.
    """
    first, now = ({k for k, _ in parameters_far_from_prior(f)} for f in (named.base, named.fit))
    return not named.names or not now <= first


def pruned(named: Named, rule: Acceptance, say: Say) -> Named:
    """Drop what is not missed or not certain, one after the other; all that stays is certain.

    What goes first may take the certainty of the others with it; then another goes first.
    """
    fit = named.fit
    lost = lost_without(named.base, fit)
    nats = [n for n, _ in lost]
    order = sorted(range(len(lost)), key=lambda i: nats[i])
    doomed = [i for i in order if not rule.keeps(fit, i, nats)]
    if not doomed:
        return replace(named, p=min([named.p, *rule.ps(fit)]))
    good = [i for i in doomed if rule.all_significant(lost[i][1])]
    first = good[0] if good else doomed[0]
    say(f"Removed by backward elimination: {fit.candidates[first].name}")
    rest = lost[first][1]
    rivals = named.competing if rest.candidates else {}
    return pruned(replace(named, fit=rest, competing=rivals), rule, say)


def lost_without(base: Fit, fit: Fit) -> list[tuple[float, Fit]]:
    """Return of each effect the nats lost without it, and the fit of the others.

    Where the others cannot run alone all is lost, and nothing but the base is left.
    """
    count = len(fit.candidates)
    if count == 1:
        return [(fit.score - base.score, base)]
    without = in_threads(lambda i: fitted_without(fit, i), range(count))
    return [(math.inf, base) if w is None else (fit.score - w.score, w) for w in without]


def _behind(best: Fit, tried: Sequence[Fit]) -> dict[str, float]:
    """Nats by which others come behind the best one, each where it did best. tried: best first."""
    return {
        t.candidates[-1].name: best.score - t.score
        for t in reversed(tried)
        if t.candidates[-1].name != best.candidates[-1].name
    }


def _doubts(fit: Fit, tried: Sequence[Fit]) -> dict[str, str]:
    """Say what speaks beforehand against effects that were tried beside those of a fit."""
    news = {c.name: (c, t) for t in tried for c in t.effects[len(fit.candidates) :]}
    found = {name: doubts(c, t) for name, (c, t) in news.items()}
    return {name: priors[0].reason for name, priors in found.items() if priors}
