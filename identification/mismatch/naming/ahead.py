"""Where numbers are known to factors, not to per cent: begin as told, and look one step ahead.

Numbers that may move by factors can run away from a motion without which what is missing has
nothing to act on: a time constant of 0.5 s ran to 20 s, and with the changes of direction went the
trace of a counter that is blind to them. So hypotheses are fitted from what the file tells as well.

And one missing effect can hide another: a belt that swings and a counter that is blind to
direction are worth less alone than some effect that is not there, and more together than any. So
each of the most promising kinds is judged by the best pair that it begins.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence

from slipbench.identification.mismatch.fit.calibrate import as_told, from_far
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit, with_effects
from slipbench.identification.mismatch.fit.judge import Judge
from slipbench.identification.mismatch.naming.score import Score, survey
from slipbench.identification.mismatch.simulation.threads import in_threads
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError

KINDS = 16
"""First halves that are tried, each of another kind: one kind at two places is often one thing."""
SURVEYS = 3 + KINDS
"""How often the library is looked through: re-calibrated, after a single effect, as told, and after
each first half."""
SECONDS = 3
"""Second halves that are fitted to each."""
LEFT = 0.05
"""Share of what a single effect brings, below which there is nothing to look ahead for."""
PROMISED = 3.0
"""Times what a score promises, that a fit may bring: a score goes straight on, from far away."""
Passes = Callable[[Fit, Fit], bool]


def further(
    before: Fit,
    passed: Sequence[Fit],
    library: Sequence[type[Effect]],
    passes: Passes,
    enough: float,
    say: Callable[[str], None],
) -> list[Fit]:
    """Return what passes, best first: what did already, and singles and pairs begun as told.

    before: without effects. enough: nats that one effect must bring.
    """
    if passed and _leaves_nothing(before, passed[0], library):
        return list(passed)
    told = as_told(before.model, before.model.origin())
    halves = _one_of_each_kind(survey(Judge.of(told), library).scores)
    for half in halves:
        say(f"Look-ahead from {half.name.replace('_', ' ')}")
    singles = [f for f in in_threads(lambda half: _fitted(told, half), halves) if f is not None]
    found = [*passed, *(f for f in singles if passes(before, f))]
    most = max([before.score, *(f.score for f in found)]) + enough
    pairs = in_threads(lambda single: list(_pairs(single, library, most)), singles)
    found += [p for ps in pairs for p in ps if p.score > most and passes(before, p)]
    return sorted(found, key=lambda f: -f.score)


def _leaves_nothing(before: Fit, single: Fit, library: Sequence[type[Effect]]) -> bool:
    """Whether nothing else promises much beside what one effect brings."""
    left = survey(Judge.of(single), library).scores
    return not left or left[0].gain < LEFT * (single.score - before.score)


def _one_of_each_kind(scores: Iterable[Score]) -> list[Candidate]:
    best: dict[str, Candidate] = {}
    for score in scores:
        best.setdefault(score.candidate.kind.name, score.candidate)
    return list(best.values())[:KINDS]


def _pairs(single: Fit, library: Sequence[type[Effect]], enough: float) -> Iterator[Fit]:
    """Yield the pairs that a single begins, those that promise enough."""
    for score in survey(Judge.of(single), library).scores[:SECONDS]:
        if single.score + PROMISED * score.gain > enough:
            pair = _fitted(single, score.candidate)
            if pair is not None:
                yield pair


def _fitted(fit: Fit, new: Candidate) -> Fit | None:
    """Fit one more effect."""
    try:
        return from_far(with_effects(fit, (*fit.candidates, new)))
    except PlantError:
        return None
