"""Pairs of effects where single ones do not suffice: one missing effect can hide another.

A belt that swings and a counter that is blind to direction are worth less alone than some effect
that is not there, and more together than any. So the most promising effects, of different kinds and
of different directions, are judged by the best pair that each begins.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

from slipbench.identification.mismatch.fit.calibrate import (
    far_from_prior,
    hidden_by_noise,
    start_fit,
)
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.far import least_squares_start
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.naming.acceptance import ENOUGH
from slipbench.identification.mismatch.naming.candidates import place_on_the_road
from slipbench.identification.mismatch.naming.fits import near_ones_refined
from slipbench.identification.mismatch.naming.named import Named
from slipbench.identification.mismatch.naming.replacement import replacement
from slipbench.identification.mismatch.naming.score import Score, as_known, of_one_kind, screen
from slipbench.identification.mismatch.naming.signatures import different, directions
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError

KINDS = 12
"""First halves that are tried, each of another kind: one kind at two places is often one thing."""
APART = 16
"""First halves that are tried, each of another direction: what alone explains little is among them."""
POOL = 64
"""First scores of which the directions are compared."""
SECONDS = 3
"""Second halves that are fitted to each: as many first ones, and as many of different directions."""
PROMISED = 3.0
"""Times what a score promises, that a fit may bring: a score goes straight on, from far away."""
SHARE = 0.1
"""Share of the best score that a first half must score, and of what both must bring that it must
bring alone; the second one may do nothing alone."""

Say = Callable[[str], None]
Way = Callable[[Score], Fit | None]
"""How an effect is fitted alone; None where it cannot."""


def halves(named: Named, library: Sequence[type[Effect]], least: float, say: Say) -> list[Fit]:
    """Fit the most promising effects of each kind and direction alone, keep those that bring enough.

    Calibration can run away from a motion without which what is missing has nothing to act on: a
    time constant of 0.5 s ran to 20 s, and with the changes of direction went the trace of a
    counter that is blind to them. So where numbers went far, they are fixed where the file has
    them; where the noise model may have kept them from going, all of them are.
    least: nats that both halves must bring.
    """
    before = named.base.coarse
    begun = _beginning(before, named, library)
    most = max((s.log_likelihood_gain for s in begun.scores), default=0.0)
    hint = max(begun.needed / PROMISED, SHARE * most)
    hopeful = [s for s in begun.scores if s.log_likelihood_gain > hint]
    apart = _apart(Linearization.of(begun.there), hopeful, APART)
    first = _in_order(hopeful, [*_one_of_each_kind(hopeful), *apart])
    for score in first:
        say(f"Look-ahead from {score.candidate.name.replace('_', ' ')}")
    done = in_threads(begun.way, first)
    enough = before.score + max(ENOUGH, SHARE * least)
    return [f for f in done if f is not None and f.score > enough]


@dataclass(frozen=True, eq=False)
class _Beginning:
    """Where first halves are looked for. scores: of a screening there; needed: nats of a half."""

    there: Fit
    scores: Sequence[Score]
    needed: float
    way: Way


def _beginning(fit: Fit, named: Named, library: Sequence[type[Effect]]) -> _Beginning:
    if hidden_by_noise(fit):
        starts = [fit]
        with suppress(PlantError):
            starts = [start_fit(fit.model, fit.model.origin()), fit]
        return _Beginning(
            starts[0],
            screen(Linearization.of(starts[0]), library, named.first).scores,
            ENOUGH,
            lambda s: _best(
                *(partial(_fitted, least_squares_start, start, s.candidate) for start in starts)
            ),
        )
    begun = replacement(fit, tuple(library), named.first) if far_from_prior(fit) else None
    if begun is not None:
        needed = max(ENOUGH, begun.least)
        return _Beginning(begun.fixed, begun.scores, needed, begun.fitted)
    return _Beginning(
        fit, named.scores, ENOUGH, lambda s: _best(partial(_fitted, optimize, fit, s.candidate))
    )


def pairs(
    named: Named, begun: Sequence[Fit], library: Sequence[type[Effect]], enough: float
) -> list[Fit]:
    """Fit what promises most beside each single effect. enough: score that a pair must reach."""
    ways = (optimize, least_squares_start) if hidden_by_noise(named.base) else (optimize,)
    several = in_threads(lambda single: list(_pairs(named, single, library, enough, ways)), begun)
    done = near_ones_refined(named.base, [pair for found in several for pair in found])
    return [pair for pair in done if pair.score > enough]


def _fitted(way: Callable[[Fit], Fit], start: Fit, *effects: Candidate) -> Fit:
    return way(with_effects(start, effects))


def _best(*tries: Callable[[], Fit]) -> Fit | None:
    """Return the best of several fits; None where none can run."""
    done = []
    for fit in tries:
        with suppress(PlantError):
            done.append(fit())
    return max(done, key=lambda f: f.score, default=None)


def _one_of_each_kind(scores: Iterable[Score]) -> list[Score]:
    best: dict[str, Score] = {}
    for score in scores:
        best.setdefault(score.candidate.kind.name, score)
    return list(best.values())[:KINDS]


def _pairs(
    named: Named,
    single: Fit,
    library: Sequence[type[Effect]],
    enough: float,
    ways: Sequence[Callable[[Fit], Fit]],
) -> Iterator[Fit]:
    """Yield the pairs that a single begins, those that promise enough."""
    linear = Linearization.of(single)
    found = screen(linear, library, named.first, SECONDS)
    for score in _seconds(linear, found.scores):
        if single.score + PROMISED * score.log_likelihood_gain > enough:
            for second in (score.candidate, *_other_variants(score, library, single.model)):
                pair = (*single.effects, second)
                done = _best(*(partial(_fitted, way, single, *pair) for way in ways))
                if done is not None:
                    yield done


def _seconds(linear: Linearization, scores: Sequence[Score]) -> list[Score]:
    """Return the first scores, and the first of different directions.

    The recordings hardly tell effects of one direction apart, and scores do not show which of them
    fits best.
    """
    return _in_order(scores, [*scores[:SECONDS], *_apart(linear, scores, SECONDS)])


def _apart(linear: Linearization, scores: Sequence[Score], most: int) -> list[Score]:
    """Return the first scores whose signatures have different directions."""
    first = scores[:POOL]
    found = directions(linear, linear.effect_responses([s.candidate for s in first]))
    return [first[i] for i in different(found, most)]


def _in_order(scores: Sequence[Score], some: Sequence[Score]) -> list[Score]:
    """Return some of the scores, each once, in the order of all."""
    chosen = {s.candidate.name for s in some}
    return [s for s in scores if s.candidate.name in chosen]


def _other_variants(
    score: Score, library: Sequence[type[Effect]], model: Model
) -> Iterator[Candidate]:
    """Yield the same effect from the other values at which it is looked for.

    From far away the value that scores best says little of the one that fits best: a belt of
    20 rad/s scored best at 2 rad/s.
    """
    here = score.candidate
    for other in (as_known(c, model) for c in of_one_kind(here, library)):
        on_the_road = place_on_the_road(other.pattern) is not None
        if other.name == here.name and other.pattern != here.pattern and not on_the_road:
            yield other
