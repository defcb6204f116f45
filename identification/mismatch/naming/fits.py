"""Fits of the effects that a screening promises, from every start that may lead to the best one."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

from slipbench.identification.mismatch.fit.calibrate import (
    as_believed,
    astray,
    refreshed,
    settled,
    strayed,
)
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.judge import Judge
from slipbench.identification.mismatch.fit.settling import settle
from slipbench.identification.mismatch.fit.sizing import limits, tried_sizes
from slipbench.identification.mismatch.naming.acceptance import ENOUGH
from slipbench.identification.mismatch.naming.score import Score, survey
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError

SHORTLIST = 4
LONGEST = 8  # scores that are fitted where they are near to the best
KEPT = 4
"""Of so many effects fitted by a few steps one goes on."""
NEAR = 0.7
"""Share of the best score's gain above which a name could be the same to these recordings."""
HOPELESS = 0.1  # share of the leader's gain below which a score gets one start only
WORTH = 6.0  # nats that a score must promise before a full fit is tried
ABSORBED = 0.01
"""Share of a signature that calibration leaves, below which it is what the numbers' bends leave."""
MUCH = 100.0  # nats that such an effect would be worth to one who knew the numbers
TRACE = 2.0  # nats that it must score all the same

Say = Callable[[str], None]
Part = TypeVar("Part")


def promising_fits(fit: Fit, scores: Sequence[Score], say: Say) -> list[Fit]:
    """Full fits of the most promising effects, best first."""
    worth = promising(scores)
    for score in worth:
        say(f"Fitting {score.candidate.name.replace('_', ' ')}")
    first = in_threads(lambda s: fitted(fit, _as_large_as_scored(s)), worth)
    leader = max((f.score - fit.score for f in first if f is not None), default=0.0)
    both = zip(worth, first, strict=True)
    done = in_threads(lambda pair: _from_several(fit, *pair, leader), both)
    return by_score(f for f in done if f is not None)


def promising(scores: Sequence[Score]) -> list[Score]:
    """Return what is worth a fit, and what calibration makes up for nearly wholly.

    Of a tyre that grows by speed the radius, the grip and the drag take nearly all: it scored 3
    nats, and brought 116 when it was fitted jointly with them.
    """
    near = NEAR * (scores[0].gain if scores else 0.0)
    tried = [*scores[:SHORTLIST], *(s for s in scores[SHORTLIST:LONGEST] if s.gain > near)]
    absorbed = [s for s in scores if s.gain > TRACE and s.kept < ABSORBED and s.typical > MUCH]
    worth = [s for s in tried if s.gain > WORTH]
    return [*worth, *(s for s in absorbed if s not in worth)][:LONGEST]


def fits_from_the_file(fit: Fit, library: Sequence[type[Effect]], say: Say) -> list[Fit]:
    """Full fits of the effects that lead from the file's numbers, where calibration went astray.

    What was made up for leaves no trace, neither beside the calibrated numbers nor beside those of
    the file, where nothing moves as it did: a backlash worth 1 900 nats scored 0.1 and 0. So all
    effects are fitted by a few steps, and those that are ahead go on: successive halving (Jamieson
    and Talwalkar, "Non-stochastic best arm identification and hyperparameter optimization",
    Proceedings of AISTATS 51 (2016)).
    """
    if not astray(fit):
        return []
    told = _unless_it_cannot_run(lambda: refreshed(as_believed(fit)))
    if told is None:
        return []
    say(f"Calibrating from the parameters of the file beside {len(library)} effects")
    scores = survey(Judge.of(told), library).scores
    ahead = _those_that_run(lambda s: with_effects(told, (*told.candidates, s.candidate)), scores)
    while len(ahead) > SHORTLIST:
        best = by_score(_those_that_run(lambda f: _a_few_steps_on(f, told), ahead))
        ahead = best[: max(len(ahead) // KEPT, SHORTLIST)]
    for one in ahead:
        say(f"Fitting {one.effects[-1].name.replace('_', ' ')} from the parameters of the file")
    return by_score(_those_that_run(lambda f: settled(refreshed(f)), ahead))


def _a_few_steps_on(fit: Fit, told: Fit) -> Fit:
    """Return the fit some steps on; its sensitivities, large ones, are taken anew when it goes on."""
    return replace(settle(refreshed(fit)), slopes=told.slopes)


def _those_that_run(way: Callable[[Part], Fit], parts: Iterable[Part]) -> list[Fit]:
    done = in_threads(lambda part: _unless_it_cannot_run(lambda: way(part)), parts)
    return [fit for fit in done if fit is not None]


def by_score(fits: Iterable[Fit]) -> list[Fit]:
    """Return fits best first."""
    return sorted(fits, key=lambda f: -f.score)


def _as_large_as_scored(score: Score) -> Candidate:
    return score.candidate.times(min(max(score.amplitude, 0.3), 2.0))


def _from_several(fit: Fit, score: Score, best: Fit | None, leader: float) -> Fit | None:
    """Return the fit from the size that scored best, and where that disappoints from others.

    best: the first. leader: nats of the best of all first fits; what promises little beside it gets
    one start. What promises less than an effect must bring gets no other sizes, but the start from
    the file: what calibration made up for promises nothing.
    """
    at = score.candidate
    hopeful = limits(at.kind) or score.gain > HOPELESS * leader
    several = hopeful and (limits(at.kind) or score.gain > ENOUGH)
    for size in tried_sizes(at.kind) if several else ():
        if best is not None and best.score - fit.score > 0.5 * score.gain:
            break
        best = _better(best, fitted(fit, at.resized(math.copysign(size, at.size))))
    if hopeful and strayed(fit):
        best = _better(best, fitted_from_the_file(fit, _as_large_as_scored(score)))
    return best


def _better(one: Fit | None, other: Fit | None) -> Fit | None:
    return max((f for f in (one, other) if f is not None), key=lambda f: f.score, default=None)


def fitted(fit: Fit, *new: Candidate) -> Fit | None:
    """Return the fit with more effects; None where they cannot run."""
    return _unless_it_cannot_run(lambda: settled(with_effects(fit, (*fit.candidates, *new))))


def fitted_without(fit: Fit, i: int) -> Fit | None:
    """Return the fit without one of its effects; None where the others cannot run alone."""
    rest = (*fit.candidates[:i], *fit.candidates[i + 1 :])
    return _unless_it_cannot_run(lambda: settled(with_effects(fit, rest)))


def fitted_from_the_file(fit: Fit, new: Candidate) -> Fit | None:
    """Fit an effect beside numbers that have not made up for its absence."""
    both = (*fit.candidates, new)
    return _unless_it_cannot_run(lambda: settled(refreshed(as_believed(with_effects(fit, both)))))


def _unless_it_cannot_run(way: Callable[[], Fit]) -> Fit | None:
    try:
        return way()
    except PlantError:
        return None
