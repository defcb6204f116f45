"""Name what is missing: every effect is scored, the best are fitted fully, one after the other.

An effect is accepted where it brings enough nats and its size is certain against errors that hang
together, over all that was tried. Then each accepted one is dropped and must be missed. Where no
single effect passes, pairs are tried: half of a pair can look useless alone.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations

from slipbench.identification.mismatch.fit.calibrate import astray, followed
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.held_out import Veto, contradicted
from slipbench.identification.mismatch.fit.judge import Judge
from slipbench.identification.mismatch.fit.scatter import FAMILY, SHARE
from slipbench.identification.mismatch.naming.accepting import ENOUGH, passes
from slipbench.identification.mismatch.naming.ahead import SURVEYS, further
from slipbench.identification.mismatch.naming.certainty import Certainty
from slipbench.identification.mismatch.naming.full_fits import (
    absorbed_fits,
    as_believed_fits,
    by_score,
    fitted,
    full_fits,
)
from slipbench.identification.mismatch.naming.interval import significance
from slipbench.identification.mismatch.naming.plausibility import doubts, plausible_first
from slipbench.identification.mismatch.naming.pruning import pruned
from slipbench.identification.mismatch.naming.score import Score, survey
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.plant.effects.effect import Effect

MOST = 3
HALVES = 3  # effects of which pairs are tried
ALIKE = 10.0  # nats within which two names are one class
CHANCES = 3  # of those that pass, how many are held against the held-out recordings

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Named:
    """What was accepted. base: without any; rivals: name -> nats behind, by accepted name.

    p: of the strongest of all that was tried, family-wise over the library and the free curves.
    vetoes: what passed on the training recordings and held-out ones contradict.
    doubts: what speaks against names beforehand (see plausibility.py), by name.
    """

    base: Fit
    fit: Fit
    scores: list[Score]
    p: float
    rivals: dict[str, dict[str, float]] = field(default_factory=dict)
    vetoes: tuple[Veto, ...] = ()
    doubts: dict[str, str] = field(default_factory=dict)

    @property
    def names(self) -> list[str]:
        """Names of the accepted effects."""
        return [c.name for c in self.fit.candidates]

    @property
    def gain(self) -> float:
        """Nats that the accepted effects bring."""
        return self.fit.score - self.base.score


def name(
    base: Fit, library: Sequence[type[Effect]], say: Say, held_out: Model | None = None
) -> Named:
    """Find up to three effects that the recordings ask for and held-out ones do not contradict."""
    first = survey(Judge.of(base), library)
    surveys = SURVEYS if base.model.system.by_factors else 1 + astray(base)
    certainty = Certainty(FAMILY * SHARE / (surveys * first.tests), held_out)
    fit, rivals, found, best_p = base, dict[str, dict[str, float]](), first.scores, 1.0
    vetoes, doubtful = list[Veto](), dict[str, str]()
    while len(fit.candidates) < MOST:
        rough = fit.coarse()
        done = by_score([*full_fits(rough, found, say), *as_believed_fits(rough, library, say)])
        passed = [t for t in done if passes(rough, t, certainty)]
        passed = plausible_first(passed, len(rough.candidates), ALIKE)[:CHANCES]
        if not passed and not base.model.system.by_factors:
            bent = absorbed_fits(rough, found, say)
            passed = [t for t in bent if passes(rough, t, certainty)][:CHANCES]
        if not passed and not fit.candidates:
            passed = _pairs(rough, found, certainty, say)[:CHANCES]
        if base.model.system.by_factors and not fit.candidates:
            ahead = further(
                rough, passed, library, lambda a, b: passes(a, b, certainty), ENOUGH, say
            )
            passed = plausible_first(ahead, len(rough.candidates), ALIKE)[:CHANCES]
        if not passed:
            best_p = min((_least_p(rough, t) for t in done), default=1.0)
        best, finer = _first_that_holds(fit, passed, certainty, vetoes)
        if best is None or finer is None:
            break
        news = [c.name for c in best.candidates if c.name not in {e.name for e in fit.candidates}]
        rivals[" + ".join(news)] = _behind(best, done)
        doubtful |= _doubts(fit, [best, *done])
        say(f"Accepted: {', '.join(news)} (log-likelihood gain {finer.score - fit.score:.0f} nats)")
        fit = finer
        found = survey(Judge.of(fit), library).scores
    fit = pruned(base, fit, certainty, say)
    certain = [certainty.p(fit, i) for i in range(len(fit.candidates))]
    rivals = rivals if certain else {}
    least = min(certain) if certain else max(best_p, certainty.limit)
    p = min(1.0, least / certainty.limit * FAMILY)
    return Named(base, fit, first.scores, p, rivals, tuple(vetoes), doubtful)


def _first_that_holds(
    fit: Fit, passed: Sequence[Fit], certainty: Certainty, vetoes: list[Veto]
) -> tuple[Fit | None, Fit | None]:
    """Return the first that passes with fine steps as well, coarse and fine; note the vetoes."""
    held_out = certainty.held_out
    for rough in passed:
        finer = followed(rough.fine(fit.model))
        if passes(fit, finer, certainty):
            against = None if held_out is None else contradicted(fit, finer, held_out)
            if against is None:
                return rough, finer
            vetoes.append(against)
    return None, None


def _least_p(before: Fit, after: Fit) -> float:
    """p of what was tried in vain; what brings too little does not count at all."""
    enough = after.score - before.score >= ENOUGH
    return significance(after, len(before.candidates)) if enough else 1.0


def _pairs(fit: Fit, scores: Sequence[Score], certainty: Certainty, say: Say) -> list[Fit]:
    """Try pairs of the most promising effects; those that pass, best first."""
    halves = [s.candidate for s in scores if s.gain > 1.0][:HALVES]
    done = []
    for a, b in combinations(halves, 2):
        say(f"Fitting {a.name} with {b.name}".replace("_", " "))
        done.append(fitted(fit, a, b))
    passed = [d for d in done if d is not None and passes(fit, d, certainty)]
    return sorted(passed, key=lambda d: -d.score)


def _doubts(fit: Fit, tried: Sequence[Fit]) -> dict[str, str]:
    """Say what speaks beforehand against effects that were tried beside those of a fit."""
    news = {c.name: (c, t) for t in tried for c in t.effects[len(fit.candidates) :]}
    found = {name: doubts(c, t) for name, (c, t) in news.items()}
    return {name: priors[0].reason for name, priors in found.items() if priors}


def _behind(best: Fit, tried: Sequence[Fit]) -> dict[str, float]:
    return {
        t.candidates[-1].name: best.score - t.score
        for t in tried
        if t.candidates[-1].name != best.candidates[-1].name
    }
