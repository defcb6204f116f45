"""Look-ahead over pairs of effects, because one missing effect can mask another.

An elastic belt and a direction-blind counter each explain less alone than some absent effect, and
together more than any. So the most promising effects, of different kinds and of different response
directions, are compared by the best pair that contains each.
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
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.least_squares_start import least_squares_start
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.naming.candidates import place_in_record
from slipbench.identification.mismatch.naming.fits import NEAR, near_ones_refined
from slipbench.identification.mismatch.naming.named import Named
from slipbench.identification.mismatch.naming.replacement import replacement
from slipbench.identification.mismatch.naming.score import (
    Score,
    as_known,
    of_one_kind,
    scores,
    screen,
)
from slipbench.identification.mismatch.naming.score_tests import different, directions
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.identification.mismatch.thresholds import REQUIRED_GAIN
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError

KINDS = 12
"""Largest number of first effects of different kinds: two locations of a kind are often one
effect."""
APART = 16
"""Largest number of first effects of different directions; these include effects that explain
little alone."""
POOL = 64
"""Number of leading scores whose directions are compared."""
SECONDS = 3
"""Second effects fitted to each first one: as many by score, and as many of different
directions."""
PROMISED = 3.0
"""Ratio of the gain of a fit to its score that is allowed for: a score extrapolates linearly."""
SHARE = 0.1
"""Share of the best score required of a first effect, and share of the pair's gain required of it
alone; the second effect may gain nothing alone."""

Say = Callable[[str], None]
Way = Callable[[Score], Fit | None]
"""Fits an effect alone; None where it cannot be simulated."""


def first_effects(
    named: Named, library: Sequence[type[Effect]], required: float, say: Say
) -> list[Fit]:
    """Fit the most promising effects of each kind and direction alone; return the successful ones.

    Calibration can remove a motion on which the missing effect depends: a time constant of 0.5 s
    went to 20 s, and without the changes of direction a direction-blind counter had no response. So
    parameters far from the file are fixed at its values. If the noise model may have kept
    parameters near their start, they are fitted by plain least squares from the values of the file,
    and where that gains anything, from the calibrated ones as well. required: gain required of both
    effects together, nats.
    """
    base = named.base.coarse
    enough = base.score + max(REQUIRED_GAIN, SHARE * required)
    start = _start(base, named, library, enough)
    best_score = max((s.log_likelihood_gain for s in start.scores), default=0.0)
    threshold = max(start.required / PROMISED, SHARE * best_score)
    promising = [
        s for s in start.scores if s.log_likelihood_gain > threshold and not s.is_negligible
    ]
    distinct = _of_different_directions(Linearization.of(start.fit), promising, APART)
    first = _in_order(promising, [*_one_of_each_kind(promising), *distinct])
    for score in first:
        say(f"Look-ahead from {score.candidate.name.replace('_', ' ')}")
    fits = in_threads(start.fit_alone, first)
    return [f for f in fits if f is not None and f.score > enough]


@dataclass(frozen=True, eq=False)
class _Start:
    """Start of first effects. scores: of a screening; required: gain of an effect, nats."""

    fit: Fit
    scores: Sequence[Score]
    required: float
    fit_alone: Way


def _start(fit: Fit, named: Named, library: Sequence[type[Effect]], enough: float) -> _Start:
    """Return the start of first effects. fit: of none; enough: score required of one of them."""
    if hidden_by_noise(fit):
        start = fit
        with suppress(PlantError):
            start = start_fit(fit.model, fit.model.origin())
        method = partial(least_squares_start, rival=enough)

        def from_both(score: Score) -> Fit | None:
            first = _best(partial(_fitted, method, start, score.candidate))
            if first is None or first.score < fit.score:
                return first
            return _best(lambda: first, partial(_fitted, method, fit, score.candidate))

        return _Start(
            start,
            screen(Linearization.of(start), library, named.first).scores,
            REQUIRED_GAIN,
            from_both,
        )
    replaced = replacement(fit, tuple(library), named.first) if far_from_prior(fit) else None
    if replaced is not None:
        required = max(REQUIRED_GAIN, replaced.least)
        return _Start(replaced.fixed, replaced.scores, required, replaced.fitted)
    return _Start(
        fit,
        named.scores,
        REQUIRED_GAIN,
        lambda s: _best(partial(_fitted, optimize, fit, s.candidate)),
    )


def pairs(
    named: Named, singles: Sequence[Fit], library: Sequence[type[Effect]], required: float
) -> list[Fit]:
    """Fit the most promising second effects beside each first one. required: score of a pair."""
    base = named.base
    least = base.score + NEAR * (required - base.score)
    fitted = partial(_pair, least if hidden_by_noise(base) else None)
    several = in_threads(
        lambda single: [fitted(single, s) for s in _seconds(named, single, library, required)],
        singles,
    )
    near = [pair for found in several for pair in found if pair is not None and pair.score > least]
    return [pair for pair in near_ones_refined(base, near) if pair.score > required]


def _pair(rival: float | None, single: Fit, second: Candidate) -> Fit | None:
    """Fit a pair; by plain least squares as well where the noise model still holds it.

    rival: score of a known fit; None: the noise model does not hold the fit of none.
    """
    pair = (*single.effects, second)
    fit = _best(partial(_fitted, optimize, single, *pair))
    if rival is None or (fit is not None and not hidden_by_noise(fit)):
        return fit
    plain = partial(least_squares_start, rival=rival)
    return _best(*([] if fit is None else [lambda: fit]), partial(_fitted, plain, single, *pair))


def _fitted(method: Callable[[Fit], Fit], start: Fit, *effects: Candidate) -> Fit:
    return method(with_effects(start, effects))


def _best(*fits: Callable[[], Fit]) -> Fit | None:
    """Return the best of several fits; None where none can be simulated."""
    results = []
    for fit in fits:
        with suppress(PlantError):
            results.append(fit())
    return max(results, key=lambda f: f.score, default=None)


def _one_of_each_kind(scores: Iterable[Score]) -> list[Score]:
    best: dict[str, Score] = {}
    for score in scores:
        best.setdefault(score.candidate.kind.name, score)
    return list(best.values())[:KINDS]


def _seconds(
    named: Named, single: Fit, library: Sequence[type[Effect]], required: float
) -> Iterator[Candidate]:
    """Yield the second effects of pairs whose score may reach the required one.

    These are the leading scores, and the leading ones of different directions: recordings hardly
    distinguish effects of one direction, and scores do not determine which of them fits best. The
    other values of their integer parameters are scored as well.
    """
    linear = Linearization.of(single)
    found = screen(linear, library, named.first, SECONDS).scores
    known = [s for s in found if not s.is_negligible]
    leading = [*known[:SECONDS], *_of_different_directions(linear, known, SECONDS)]
    seconds = [s for s in _in_order(known, leading) if _may_reach(required, single, s)]
    variants = [v for s in seconds for v in _other_variants(s, library, single.model)]
    for score in (*seconds, *scores(linear, variants)):
        if _may_reach(required, single, score):
            yield score.candidate


def _may_reach(required: float, single: Fit, second: Score) -> bool:
    return single.score + PROMISED * second.log_likelihood_gain > required


def _of_different_directions(
    linear: Linearization, scores: Sequence[Score], most: int
) -> list[Score]:
    """Return the leading scores whose effect responses have different directions."""
    first = scores[:POOL]
    response_directions = directions(linear, linear.effect_responses([s.candidate for s in first]))
    return [first[i] for i in different(response_directions, most)]


def _in_order(scores: Sequence[Score], selected: Sequence[Score]) -> list[Score]:
    """Return selected scores, each once, in the order of all."""
    names = {s.candidate.name for s in selected}
    return [s for s in scores if s.candidate.name in names]


def _other_variants(
    score: Score, library: Sequence[type[Effect]], model: Model
) -> Iterator[Candidate]:
    """Yield the same effect at the other values tested.

    Far from the optimum the value that scores best hardly predicts the one that fits best: a belt
    of 20 rad/s scored best at 2 rad/s.
    """
    candidate = score.candidate
    for other in (as_known(c, model) for c in of_one_kind(candidate, library)):
        has_placebo = place_in_record(other.pattern) is not None
        if other.name == candidate.name and other.pattern != candidate.pattern and not has_placebo:
            yield other
