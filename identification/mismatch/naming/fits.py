"""Fits of the effects that a screening promises, from every start that may lead to the best one."""

import math
from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache

from slipbench.identification.mismatch.fit.calibrate import (
    at_prior_mean,
    far_from_prior,
    hidden_by_noise,
    map_fit,
    refined,
)
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.sizing import limits, trial_sizes
from slipbench.identification.mismatch.naming.replacement import replacement
from slipbench.identification.mismatch.naming.score import Score, Screening
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError

SHORTLIST = 4  # scores of different traces that are fitted
SAME = 1e-3
"""Share in which the gains of two effects differ that leave the same trace: a gain, a reversed sign."""
LONGEST = 8  # scores that are fitted where they are near to the best
NEAR = 0.7
"""Share of the best score's gain above which a name could be the same to these recordings."""
WORTH = 6.0  # nats that a score must promise before a full fit is tried
ABSORBED = 0.01
"""Share of a signature that calibration leaves, below which it is what the numbers' bends leave."""
MUCH = 100.0  # nats that such an effect would be worth to one who knew the numbers
TRACE = 2.0  # nats that it must score all the same

Say = Callable[[str], None]


def promising_fits(fit: Fit, scores: Sequence[Score], say: Say) -> list[Fit]:
    """Fits of the most promising effects, best first; those that come near to the best are full."""
    worth = promising(scores)
    for score in worth:
        say(f"Fitting {score.candidate.name.replace('_', ' ')}")
    rough = in_threads(lambda s: _from_several(fit, s), worth)
    return by_score(near_ones_refined(fit, rough))


def near_ones_refined(base: Fit, rough: Iterable[Fit | None]) -> list[Fit]:
    """Return fits that have settled, the best of them and those near to it refined.

    Sensitivities taken anew bring a fit the last part of its way; one that is far behind before is
    behind after it. Where the noise model holds fits where they begin, none is known to be behind.
    """
    tried = [f for f in rough if f is not None]
    near = NEAR * max((_brought(f, base) for f in tried), default=0.0)
    return in_threads(
        lambda f: _refined(f) if _brought(f, base) >= near or hidden_by_noise(f) else f, tried
    )


def others_refined(base: Fit, tried: Iterable[Fit]) -> list[Fit]:
    """Refine the fits that were left behind as well; none where no fit was.

    Those that led may be uncertain, or contradicted, and what is behind them right.
    """
    left = [f for f in tried if f.slopes is base.slopes]
    return in_threads(_refined, left)


def _brought(fit: Fit, base: Fit) -> float:
    """Nats beyond the base, as far as they count: as much is found at any place of some effects."""
    places = [c.placebo for c in fit.candidates[len(base.candidates) :] if c.placebo]
    return (fit.score - base.score) / max((p.inflation for p in places), default=1.0)


def _refined(fit: Fit) -> Fit:
    return _unless_it_cannot_run(lambda: refined(fit)) or fit


def promising(scores: Sequence[Score], enough: float = WORTH) -> list[Score]:
    """Return what is worth a fit, and what calibration makes up for nearly wholly.

    enough: nats that a score must promise.

    Of a tyre that grows by speed the radius, the grip and the drag take nearly all: it scored 3
    nats, and brought 116 when it was fitted jointly with them.
    """
    near = NEAR * (scores[0].log_likelihood_gain if scores else 0.0)
    least = min(_of_different_traces(scores), default=0.0)
    tried = [
        s
        for s in scores[:LONGEST]
        if s.log_likelihood_gain > near or s.log_likelihood_gain >= least
    ]
    absorbed = [
        s
        for s in scores
        if s.log_likelihood_gain > TRACE and s.kept < ABSORBED and s.typical > MUCH
    ]
    worth = [s for s in tried if s.log_likelihood_gain > enough]
    return [*worth, *(s for s in absorbed if s not in worth)][:LONGEST]


def _of_different_traces(scores: Sequence[Score]) -> list[float]:
    """Return the gains of the first SHORTLIST traces; effects of one trace count once."""
    found: list[float] = []
    for gain in (s.log_likelihood_gain for s in scores):
        if len(found) == SHORTLIST:
            break
        if not found or gain < (1.0 - SAME) * found[-1]:
            found.append(gain)
    return found


def fits_from_the_file(
    fit: Fit, library: Sequence[type[Effect]], say: Say, before: Screening | None = None
) -> list[Fit]:
    """Full fits of promising effects in the place of numbers that calibration moved far, best first.

    The other numbers make up for a part of an effect: of a backlash worth 210 nats a score was 2.3.
    before: a screening of another fit of the same recordings.
    """
    if not far_from_prior(fit):
        return []
    say(f"Screening {len(library)} effects beside the numbers of the file")
    begun = replacement(fit, tuple(library), before)
    worth = promising(begun.scores, TRACE) if begun else []
    for score in worth:
        say(f"Fitting {score.candidate.name.replace('_', ' ')} beside the numbers of the file")
    done = in_threads(begun.fitted, worth) if begun else []
    return by_score(f for f in done if f is not None)


def by_score(fits: Iterable[Fit]) -> list[Fit]:
    """Return fits best first."""
    return sorted(fits, key=lambda f: -f.score)


def _from_several(fit: Fit, score: Score) -> Fit | None:
    """Return the fit from the size that scored best; of limits, where it disappoints, from others.

    Beyond its reach a limit does nothing, and no slope leads back.
    """
    at, best = score.candidate, roughly(fit, score.as_large_as_scored())
    for size in trial_sizes(at.kind) if limits(at.kind) else ():
        if best is not None and best.score - fit.score > 0.5 * score.log_likelihood_gain:
            break
        best = _better(best, roughly(fit, at.resized(math.copysign(size, at.size))))
    return best


def _better(one: Fit | None, other: Fit | None) -> Fit | None:
    return max((f for f in (one, other) if f is not None), key=lambda f: f.score, default=None)


def roughly(fit: Fit, *new: Candidate) -> Fit | None:
    """Return the fit with more effects, settled with its sensitivities; None where they cannot run."""
    return _unless_it_cannot_run(lambda: optimize(with_effects(fit, (*fit.candidates, *new))))


def fitted(fit: Fit, *new: Candidate) -> Fit | None:
    """Return the fit with more effects; None where they cannot run."""
    return _unless_it_cannot_run(lambda: map_fit(with_effects(fit, (*fit.candidates, *new))))


def beside_the_file(fit: Fit) -> Fit | None:
    """Return the fit of the same effects from the numbers of the file; None where they cannot run."""
    return _unless_it_cannot_run(lambda: map_fit(at_prior_mean(fit)))


def moved(base: Fit, fit: Fit, i: int, there: Candidate) -> Fit | None:
    """Return the fit with one of its effects at another place, begun with all else as it is.

    None where it cannot run there, or is far behind before it is refined, or brings less after it.
    base: the fit without effects.
    """
    rest = (*fit.candidates[:i], *fit.candidates[i + 1 :])
    rough = _unless_it_cannot_run(lambda: optimize(with_effects(fit, (*rest, there))))
    if rough is None or rough.score < base.score + NEAR * (fit.score - base.score):
        return None
    new = _refined(rough)
    return new if new.score > fit.score else None


@lru_cache(maxsize=4)
def fitted_without(fit: Fit, i: int) -> Fit | None:
    """Return the fit without one of its effects; None where the others cannot run alone."""
    rest = (*fit.candidates[:i], *fit.candidates[i + 1 :])
    return _unless_it_cannot_run(lambda: map_fit(with_effects(fit, rest)))


def _unless_it_cannot_run(way: Callable[[], Fit]) -> Fit | None:
    try:
        return way()
    except PlantError:
        return None
