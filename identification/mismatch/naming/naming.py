"""Name what is missing: every effect is scored, the best are fitted fully, one after the other.

An effect is accepted where it brings enough nats and its size is certain against errors that hang
together, over all that was tried. Then each accepted one is dropped and must be missed. Where no
single effect passes, pairs are tried: half of a pair can look useless alone.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import combinations

from identification.mismatch.fit.calibrate import (
    WORTH_AGAIN,
    as_believed,
    followed,
    from_far,
    partly_refreshed,
    strayed,
    unbent,
)
from identification.mismatch.fit.candidate import Candidate
from identification.mismatch.fit.dialled import Dialled
from identification.mismatch.fit.fitting import Fit, renoised, with_effects
from identification.mismatch.fit.held_out import contradicted
from identification.mismatch.fit.judge import Judge
from identification.mismatch.fit.scatter import FAMILY, SHARE
from identification.mismatch.fit.settling import settle
from identification.mismatch.fit.sizing import limits, tried_sizes
from identification.mismatch.naming.ahead import SURVEYS, further
from identification.mismatch.naming.interval import significance
from identification.mismatch.naming.score import Score, survey
from identification.mismatch.simulation.model import Model
from plant.effects.effect import Effect
from plant.trouble import PlantError

MOST = 3
SHORTLIST = 4
LONGEST = 8  # scores that are fitted where they are near to the best
NEAR = 0.7
"""Share of the best score's gain above which a name could be the same to these recordings."""
HALVES = 3  # effects of which pairs are tried
HOPELESS = 0.1  # share of the leader's gain below which a score gets one start only
WORTH = 6.0  # nats that a score must promise before a full fit is tried
ENOUGH = 12.0  # nats that an effect must bring
ALIKE = 10.0  # nats within which two names are one class
INEXACT = 0.05
"""Share of what an effect brings that its formula may leave to others at the same place."""
CHANCES = 3  # of those that pass, how many are held against the held-out recordings
AGAIN = 1  # times that sensitivities are taken anew while an effect is fitted

Say = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Named:
    """What was accepted. base: without any; rivals: name -> nats behind, by accepted name.

    p: of the strongest of all that was tried, family-wise over the library and the free curves.
    """

    base: Fit
    fit: Fit
    scores: list[Score]
    p: float
    rivals: dict[str, dict[str, float]] = field(default_factory=dict)

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
    surveys = SURVEYS if base.model.system.by_factors else 1
    limit = FAMILY * SHARE / (surveys * first.tests)
    fit, rivals, found, best_p = base, dict[str, dict[str, float]](), first.scores, 1.0
    while len(fit.candidates) < MOST:
        rough = fit.coarse()
        tried = _tried(rough, found, say)
        passed = [t for t in tried if _passes(rough, t, limit)][:CHANCES]
        if not passed and not fit.candidates:
            passed = _pairs(rough, found, limit, say)[:CHANCES]
        if base.model.system.by_factors and not fit.candidates:
            passed = further(
                rough, passed, library, lambda a, b: _passes(a, b, limit), ENOUGH, say
            )[:CHANCES]
        if not passed:
            best_p = min((_least_p(rough, t) for t in tried), default=1.0)
        best, finer = _first_that_holds(fit, passed, limit, held_out, say)
        if best is None or finer is None:
            break
        news = [c.name for c in best.candidates if c.name not in {e.name for e in fit.candidates}]
        rivals[" + ".join(news)] = _behind(best, tried)
        say(f"accepted: {', '.join(news)} ({finer.score - fit.score:.0f} nats)")
        fit = finer
        found = survey(Judge.of(fit), library).scores
    fit = _pruned(base, fit, limit, say)
    fitted = [significance(fit, i) for i in range(len(fit.candidates))]
    rivals = rivals if fitted else {}
    least = min(fitted) if fitted else max(best_p, limit)
    return Named(base, fit, first.scores, min(1.0, least / limit * FAMILY), rivals)


def _first_that_holds(
    fit: Fit, passed: Sequence[Fit], limit: float, held_out: Model | None, say: Say
) -> tuple[Fit | None, Fit | None]:
    """Return the first that passes with fine steps as well, coarse and fine."""
    for rough in passed:
        finer = followed(rough.fine(fit.model))
        if _passes(fit, finer, limit):
            if held_out is None or not contradicted(fit, finer, held_out):
                return rough, finer
            say(f"contradicted by the held-out recordings: {rough.candidates[-1].name}")
    return None, None


def _least_p(before: Fit, after: Fit) -> float:
    """p of what was tried in vain; what brings too little does not count at all."""
    enough = after.score - before.score >= ENOUGH
    return significance(after, len(before.candidates)) if enough else 1.0


def _tried(fit: Fit, scores: Sequence[Score], say: Say) -> list[Fit]:
    """Full fits of the most promising effects, best first."""
    done: list[Fit] = []
    near = NEAR * (scores[0].gain if scores else 0.0)
    for score in [*scores[:SHORTLIST], *(s for s in scores[SHORTLIST:LONGEST] if s.gain > near)]:
        if score.gain > WORTH:
            say(f"fitting {score.candidate.name.replace('_', ' ')}")
            leader = max((d.score - fit.score for d in done), default=0.0)
            found = _from_several(fit, score, leader)
            done += [found] if found is not None else []
    return sorted(done, key=lambda d: -d.score)


def _from_several(fit: Fit, score: Score, leader: float) -> Fit | None:
    """Fit from the size that scored best, and where that disappoints from others.

    leader: nats of the best fit so far; what promises little beside it gets one start.
    """
    at = score.candidate
    first = at.resized(at.size * min(max(score.amplitude, 0.3), 2.0))
    best = _fitted(fit, first)
    several = limits(at.kind) or score.gain > HOPELESS * leader
    for size in tried_sizes(at.kind) if several else ():
        if best is not None and best.score - fit.score > 0.5 * score.gain:
            break
        best = _better(best, _fitted(fit, at.resized(math.copysign(size, at.size))))
    if several and strayed(fit) and not fit.model.system.by_factors:
        best = _better(best, _fitted_from_the_file(fit, first))
    return best


def _better(one: Fit | None, other: Fit | None) -> Fit | None:
    return max((f for f in (one, other) if f is not None), key=lambda f: f.score, default=None)


def _fitted(fit: Fit, *new: Candidate) -> Fit | None:
    try:
        return _settled(with_effects(fit, (*fit.candidates, *new)))
    except PlantError:
        return None


def _fitted_from_the_file(fit: Fit, new: Candidate) -> Fit | None:
    """Fit an effect beside numbers that have not made up for its absence."""
    try:
        return _settled(as_believed(with_effects(fit, (*fit.candidates, new))))
    except PlantError:
        return None


def _settled(start: Fit) -> Fit:
    """Settle, and again with sensitivities that the effects have changed, where those are cheap."""
    if start.model.system.by_factors:
        return from_far(start)
    fit = settle(start)
    for _ in range(AGAIN):
        new = partly_refreshed(fit)
        if new is fit:
            break
        new = settle(new)
        if new.score - fit.score < WORTH_AGAIN:
            fit = max(new, fit, key=lambda f: f.score)
            break
        fit = new
    return unbent(fit)


def _passes(before: Fit, after: Fit, limit: float) -> bool:
    new = after.candidates[len(before.candidates) :]
    gain = after.score - before.score
    if gain < sum(_enough(c) for c in new) or any(gain < _inexact(before, c) for c in new):
        return False
    places = range(len(before.candidates), len(after.candidates))
    return all(significance(after, i) < limit for i in places)


def _enough(new: Dialled) -> float:
    """Nats that an effect must bring; more where as much is found at any other place."""
    return ENOUGH * (new.elsewhere.inflation if new.elsewhere else 1.0)


def _inexact(fit: Fit, new: Dialled) -> float:
    """Nats that the formulas of what is named may leave to a new effect that looks alike."""
    there = [c for c in fit.candidates if _alike(fit, c, new)]
    if not there:
        return 0.0
    bare = tuple(c for c in fit.candidates if c not in there)
    return INEXACT * (fit.score - renoised(with_effects(fit, bare)).score)


def _alike(fit: Fit, one: Dialled, other: Dialled) -> bool:
    """Tell whether two effects act at one place, or on a quantity and on its only sensor."""
    here, there = place_of(fit, one), place_of(fit, other)
    if here and here == there:
        return True
    if not (isinstance(one, Candidate) and isinstance(other, Candidate)):
        return False
    sensed = hasattr(one.kind, "tell") or hasattr(other.kind, "tell")
    system, chain = fit.model.system, fit.model.chain
    return sensed and any(
        sum(len(b.outputs) for b in chain.blocks if b.drive == drive) == 1
        and all(system.concerns(c.pattern, chain, drive) for c in (one, other))
        for drive in chain.drives
    )


def place_of(fit: Fit, one: Dialled) -> str:
    """Return where an effect acts; empty: not known."""
    return fit.model.system.acts_at(one.pattern) if isinstance(one, Candidate) else ""


def _pairs(fit: Fit, scores: Sequence[Score], limit: float, say: Say) -> list[Fit]:
    """Try pairs of the most promising effects; those that pass, best first."""
    halves = [s.candidate for s in scores if s.gain > 1.0][:HALVES]
    done = []
    for a, b in combinations(halves, 2):
        say(f"fitting {a.name} with {b.name}".replace("_", " "))
        done.append(_fitted(fit, a, b))
    passed = [d for d in done if d is not None and _passes(fit, d, limit)]
    return sorted(passed, key=lambda d: -d.score)


def _behind(best: Fit, tried: Sequence[Fit]) -> dict[str, float]:
    return {
        t.candidates[-1].name: best.score - t.score
        for t in tried if t.candidates[-1].name != best.candidates[-1].name
    }  # fmt: skip


def _pruned(base: Fit, fit: Fit, limit: float, say: Say) -> Fit:
    """Drop what is not missed or not certain, one after the other; all that stays is certain.

    What goes first may take the certainty of the others with it; then another goes first.
    """
    lost = _lost(fit) if len(fit.candidates) > 1 else [(fit.score - base.score, base)]
    order = sorted(range(len(fit.candidates)), key=lambda i: lost[i][0])
    doomed = [i for i in order if not _stays(fit, i, [x for x, _ in lost], limit)]
    if not doomed:
        return fit
    good = [i for i in doomed if _all_certain(lost[i][1], limit)]
    first = good[0] if good else doomed[0]
    say(f"not missed: {fit.candidates[first].name}")
    return _pruned(base, lost[first][1], limit, say)


def _lost(fit: Fit) -> list[tuple[float, Fit]]:
    """Return of each effect the nats lost without it, and the fit of the others."""
    without = [
        _settled(with_effects(fit, (*fit.candidates[:i], *fit.candidates[i + 1 :])))
        for i in range(len(fit.candidates))
    ]
    return [(fit.score - w.score, w) for w in without]


def _stays(fit: Fit, i: int, lost: Sequence[float], limit: float) -> bool:
    beside = [
        x for x, c in zip(lost, fit.candidates, strict=True) if _alike(fit, c, fit.candidates[i])
    ]
    enough = max(ENOUGH, INEXACT * max(beside, default=0.0))
    return lost[i] >= enough and significance(fit, i) <= limit


def _all_certain(fit: Fit, limit: float) -> bool:
    return all(significance(fit, i) <= limit for i in range(len(fit.candidates)))
