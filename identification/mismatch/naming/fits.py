"""Fits of the effects with promising scores, from every start that may lead to the best one."""

import math
from collections.abc import Callable, Iterable, Sequence

from slipbench.identification.mismatch.fit.calibrate import (
    at_prior_mean,
    far_from_prior,
    from_another_start,
    hidden_by_noise,
    map_fit,
    refined,
)
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.sizing import limits, trial_sizes
from slipbench.identification.mismatch.naming.replacement import replacement
from slipbench.identification.mismatch.naming.score import Score, Screening
from slipbench.identification.mismatch.simulation.kept import last_results
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError

SHORTLIST = 4  # scores of different effect responses that are fitted
SAME = 1e-3
"""Relative difference of gains below which two effects have the same response: a gain, a reversed
sign."""
LONGEST = 8  # largest number of scores fitted
NEAR = 0.7
"""Share of the best score's gain above which an effect may be indistinguishable from the best."""
HELD_BACK = 0.2
"""Share of it above which an effect may be the best although the noise model keeps its fit back."""
WORTH = 6.0  # nats; score required for a full fit
UNLIKELY = 0.1
"""p of a score above which an effect cannot be significant: it is negligible, or acts where the
residual varies as much without it."""
ABSORBED = 0.01
"""Share of an effect response outside the nuisances below which it may be a linearization error."""
MUCH = 100.0  # nats; gain required of such an effect if the parameters were known
TRACE = 2.0  # nats; score required of it nevertheless

Say = Callable[[str], None]


def promising_fits(fit: Fit, scores: Sequence[Score], say: Say) -> list[Fit]:
    """Fits of the most promising effects, best first; those near the best are fully refined."""
    worth = promising(scores)
    for score in worth:
        say(f"Fitting {score.candidate.name.replace('_', ' ')}")
    rough = in_threads(lambda s: _from_several_sizes(fit, s), worth)
    return by_score(near_ones_refined(fit, rough))


def near_ones_refined(base: Fit, rough: Iterable[Fit | None]) -> list[Fit]:
    """Return optimized fits, with the best and those near it refined.

    Updated sensitivities improve a fit only slightly; a fit far behind stays behind. Fits that the
    noise model keeps near their start may be farther behind, unless the best fit is free of that.
    """
    fits = [f for f in rough if f is not None]
    best = max(fits, key=lambda f: _effective_gain(f, base), default=None)
    if best is None:
        return []
    most, hidden = _effective_gain(best, base), hidden_by_noise(best)

    def is_near(fit: Fit) -> bool:
        gain = _effective_gain(fit, base)
        return gain >= NEAR * most or (hidden and gain >= HELD_BACK * most and hidden_by_noise(fit))

    return in_threads(lambda f: _refined(f) if is_near(f) else f, fits)


def others_refined(base: Fit, tried: Iterable[Fit]) -> list[Fit]:
    """Refine the remaining fits as well; none if all were refined.

    The leading fits may be insignificant or contradicted, and one of the others correct.
    """
    unrefined = [f for f in tried if f.slopes is base.slopes]
    return in_threads(_refined, unrefined)


def _effective_gain(fit: Fit, base: Fit) -> float:
    """Gain over the base, nats, divided by the variance inflation at placebo locations."""
    return (fit.score - base.score) / _inflation(fit.candidates[len(base.candidates) :])


def _inflation(candidates: Iterable[Hypothesis]) -> float:
    """Largest variance inflation at placebo locations; 1 for effects without any."""
    return max((c.placebo.inflation for c in candidates if c.placebo), default=1.0)


def _refined(fit: Fit) -> Fit:
    return _none_if_not_runnable(lambda: refined(fit)) or fit


def promising(
    scores: Sequence[Score], enough: float = WORTH, largest_p: float = UNLIKELY
) -> list[Score]:
    """Return the scores that justify a fit, and effects that calibration almost absorbs.

    enough: score required, nats. largest_p: of a score; 1 where the residual is no noise.

    The growth of a tyre with speed is nearly absorbed by radius, grip and drag: it scored 3 nats,
    and gained 116 when it was fitted jointly with them.
    """
    possible = [
        s
        for s in scores
        if s.p <= largest_p
        and not s.is_negligible
        and s.log_likelihood_gain > enough * _inflation([s.candidate])
    ]
    threshold = NEAR * (possible[0].log_likelihood_gain if possible else 0.0)
    least = min(_distinct_gains(possible), default=0.0)
    leading = [
        s
        for s in possible[:LONGEST]
        if s.log_likelihood_gain > threshold or s.log_likelihood_gain >= least
    ]
    absorbed = [
        s
        for s in scores
        if s.log_likelihood_gain > TRACE and s.kept < ABSORBED and s.typical > MUCH
    ]
    return [*leading, *(s for s in absorbed if s not in leading)][:LONGEST]


def _distinct_gains(scores: Sequence[Score]) -> list[float]:
    """Return the first SHORTLIST gains; effects of the same response count once."""
    gains: list[float] = []
    for gain in (s.log_likelihood_gain for s in scores):
        if len(gains) == SHORTLIST:
            break
        if not gains or gain < (1.0 - SAME) * gains[-1]:
            gains.append(gain)
    return gains


def fits_from_the_file(
    fit: Fit,
    library: Sequence[type[Effect]],
    say: Say,
    before: Screening | None = None,
    required: float = -math.inf,
) -> list[Fit]:
    """Refined fits of effects that replace parameters moved far from the file, best first.

    Other parameters compensate for a part of an effect: a backlash worth 210 nats scored 2.3.
    before: a screening of another fit of the same recordings. required: log-posterior below which
    a fit is not needed, nats.
    """
    if not far_from_prior(fit):
        return []
    say(f"Screening {len(library)} effects beside the numbers of the file")
    start = replacement(fit, tuple(library), before)
    if start is None:
        return []
    selected = promising(start.scores, TRACE, largest_p=1.0)
    for score in selected:
        say(f"Fitting {score.candidate.name.replace('_', ' ')} beside the numbers of the file")
    fits = in_threads(lambda score: start.fitted(score, required), selected)
    return by_score(f for f in fits if f is not None)


def by_score(fits: Iterable[Fit]) -> list[Fit]:
    """Return fits best first."""
    return sorted(fits, key=lambda f: -f.score)


def _from_several_sizes(fit: Fit, score: Score) -> Fit | None:
    """Return the fit from the size that scored best; of a limit, also from other sizes if needed.

    A limit that is never reached has no response, and then its gradient is zero.
    """
    candidate, best = score.candidate, roughly(fit, score.as_large_as_scored())
    for size in trial_sizes(candidate.kind) if limits(candidate.kind) else ():
        if best is not None and best.score - fit.score > 0.5 * score.log_likelihood_gain:
            break
        best = _better(best, roughly(fit, candidate.resized(math.copysign(size, candidate.size))))
    return best


def _better(one: Fit | None, other: Fit | None) -> Fit | None:
    return max((f for f in (one, other) if f is not None), key=lambda f: f.score, default=None)


def roughly(fit: Fit, *new: Candidate) -> Fit | None:
    """Return the fit with more effects and the given sensitivities; None where it cannot run."""
    return _none_if_not_runnable(lambda: optimize(with_effects(fit, (*fit.candidates, *new))))


def fitted(fit: Fit, *new: Candidate) -> Fit | None:
    """Return the fit with more effects; None where it cannot be simulated."""
    return _none_if_not_runnable(lambda: map_fit(with_effects(fit, (*fit.candidates, *new))))


def beside_the_file(fit: Fit) -> Fit | None:
    """Return the fit of the same effects from the values of the file; None if not runnable."""
    return _none_if_not_runnable(lambda: from_another_start(at_prior_mean(fit)))


def moved(without: Fit, fit: Fit, i: int, relocated: Candidate) -> Fit | None:
    """Return the fit with one of its effects at another location, started with all else unchanged.

    None where it cannot be simulated, is far behind before the refinement, or gains less after it.
    without: the fit without that effect.
    """
    others = (*fit.candidates[:i], *fit.candidates[i + 1 :])
    rough = _none_if_not_runnable(lambda: optimize(with_effects(fit, (*others, relocated))))
    if rough is None or rough.score < without.score + NEAR * (fit.score - without.score):
        return None
    new = _refined(rough)
    return new if new.score > fit.score else None


@last_results(8)
def fitted_without(fit: Fit, i: int) -> Fit | None:
    """Return the fit without one of its effects; None where it cannot be simulated.

    It begins with the noise model of all effects, which attributes no error of the others to noise.
    """
    others = (*fit.candidates[:i], *fit.candidates[i + 1 :])
    return _none_if_not_runnable(lambda: from_another_start(with_effects(fit, others)))


def _none_if_not_runnable(fit: Callable[[], Fit]) -> Fit | None:
    try:
        return fit()
    except PlantError:
        return None
