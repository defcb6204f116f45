"""What each candidate effect would explain, without fitting it: its signature off the nuisances."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from slipbench.identification.mismatch.curves.tooth_curve import discs
from slipbench.identification.mismatch.fit.candidate import (
    Candidate,
    beside_the_file,
    fixed_from_data,
)
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.sizing import limits
from slipbench.identification.mismatch.fit.stack import LARGEST, recordings
from slipbench.identification.mismatch.fit.variance_inflation import amplitude_p
from slipbench.identification.mismatch.naming.candidates import (
    TRIES,
    candidates,
    half_turn_shifted,
    larger,
    otherwise,
    place_on_the_road,
    reshaped,
    same_try,
)
from slipbench.identification.mismatch.naming.placebo import (
    CHANCE,
    PlaceboLocation,
    at_places,
    usual,
)
from slipbench.identification.mismatch.naming.rescreen import AGAIN, promising_again
from slipbench.identification.mismatch.naming.signatures import batches, score_tests
from slipbench.identification.mismatch.naming.traces import Traces
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.simulation.sensor import Rounds
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

HINT = 0.5
"""Nats of an amplitude, either sign, above which an effect is looked at more closely."""
SHOWN = 6.0
"""Nats that an effect of typical size must be worth to count as excited."""
NEAR = (0.3, 3.0)
"""Amplitudes for which a signature still holds."""
MOST = 2.0
"""Amplitude at most with which a fit begins: the signature of a limit bends before it triples."""
OFF = 0.7
"""Credit of a gain at other amplitudes."""
PLAIN = 50.0
"""Nats that an effect is worth at the small size at which it is tried."""
BEYOND = 20.0
"""Times that worth above which the typical size says nothing of such a small one."""
STARTS = 3
"""Tries of one effect at its typical size, at other places or angles, that are followed by others."""
RESHAPED = 8
NEXT_TO_NOTHING = 1e-9


@dataclass(frozen=True)
class Score:
    """What a candidate's signature says about residuals.

    amplitude: of the signature, 1 = as large as tried. log_likelihood_gain: nats. visible_gain: nats that the signature
    would be worth if it were there as tried. kept: share of the signature that calibration cannot
    hide. p: one-sided, of an amplitude as small as does not count. typical: what `seen` is for the
    effect at its typical size, the most telling of its tries.
    """

    candidate: Candidate
    amplitude: float
    log_likelihood_gain: float
    visible_gain: float
    kept: float
    p: float
    typical: float = 0.0

    def as_large_as_scored(self) -> Candidate:
        """Return the candidate as large as its score says, as far as a signature holds."""
        return self.candidate.amplified(min(max(self.amplitude, NEAR[0]), MOST))


Columns = dict[Candidate, Floats]
"""Signatures of candidates, (rows,) each."""


def scores(
    linear: Linearization,
    tried: Sequence[Candidate],
    kept: Columns | None = None,
    traces: Traces | None = None,
) -> list[Score]:
    """Score candidates at their sizes.

    kept: takes the signatures of those along the road; traces: take what the best ones change.
    """
    found: list[Score] = []
    for some in batches(linear, tried):
        changes = linear.changes(some)
        columns = linear.whitened(changes)
        judged = _judged(linear, some, columns)
        found += judged
        for score, column, changed in zip(judged, columns.T, changes, strict=True):
            if kept is not None and place_on_the_road(score.candidate.pattern) is not None:
                kept[score.candidate] = column.copy()
            if traces is not None and score.visible_gain > CHANCE:
                traces.add(score.candidate, _credit(score), changed)
    return found


def _judged(linear: Linearization, tried: Sequence[Candidate], columns: Floats) -> list[Score]:
    """Score candidates by their signatures, (rows, candidates), which are taken off all at once."""
    found = score_tests(linear, columns)
    p = np.ones(len(tried))
    hints = np.flatnonzero(found.visible & (found.log_likelihood_gain > HINT))
    off = linear.nuisances.subtract(columns[:, hints], found.hidden[:, hints])
    for i, course in zip(hints, np.ascontiguousarray(off.T), strict=True):
        least = tried[int(i)].negligible_difference / max(abs(tried[int(i)].added), NEXT_TO_NOTHING)
        p[i] = amplitude_p(
            course, linear.residuals, linear.clusters, linear.fit.variance_inflation, least
        )
    return [
        Score(c, float(a), float(g), 0.5 * float(e), float(e / w), float(at))
        if shown
        else Score(c, 0.0, 0.0, 0.0, 0.0, 1.0)
        for c, a, g, e, w, at, shown in zip(
            tried,
            found.amplitude,
            found.log_likelihood_gain,
            found.energy,
            found.whole_energy,
            p,
            found.visible,
            strict=True,
        )
    ]


def placebo_locations(
    linear: Linearization, places: Sequence[Candidate], kept: Columns | None = None
) -> list[PlaceboLocation]:
    """Return what each trial alone says of one effect at several places.

    kept: signatures of these candidates, where they are known already.
    """
    known = {} if kept is None else kept
    missing = [p for p in places if p not in known]
    made = dict(zip(missing, linear.effect_responses(missing).T, strict=True)) if missing else {}
    columns = np.stack([known[p] if p in known else made[p] for p in places], axis=1)
    trial = recordings(linear.fit.model)
    told = [linear.energy_and_correlation(columns, trial == r) for r in np.unique(trial)]
    length = np.sqrt(np.sum(columns**2, axis=0)) + 1e-300
    at = [place_on_the_road(p.pattern) or 0.0 for p in places]
    energy, push = (np.stack(x) for x in zip(*told, strict=True))
    even = columns / length
    alike = even.T @ even
    return at_places(at, energy, push / np.maximum(energy, 1e-300), alike)


@dataclass(frozen=True, eq=False)
class Screening:
    """scores: the best try of every effect, by what it explains, greatest first.

    tests: how many could have been found by chance. traces: what the best tries of each change.
    """

    scores: list[Score]
    tests: int
    traces: Traces = field(default_factory=Traces)


def screen(
    linear: Linearization,
    library: Iterable[type[Effect]],
    before: Screening | None = None,
    most: int = AGAIN,
) -> Screening:
    """Score every effect on every subject that it is not found on yet.

    An effect that the file has already is scored by what another size would explain.
    All are tried at their typical size. Those of which there is a hint are tried at other sizes and
    shapes as well; those that would not show at their typical size, at a large one; those that would
    show far more than plainly, at a small one, since a signature holds near its own size only.
    before: a screening of another fit of the same recordings. Where the changes of effects there are
    still valid, they select what is screened here; effects that showed nothing there are screened too.
    most: how many of them.
    """
    there = {c.name for c in linear.fit.effects}
    teeth = {disc.block: angles.size for disc, angles in discs(linear.fit)}
    known = (as_known(c, linear.fit.model) for kind in library for c in candidates(kind, teeth))
    kinds = [c for c in known if c.name not in there]
    again = promising_again(linear, before.traces, most) if before is not None else None
    if before is not None and again is not None:
        traced = before.traces.names()
        kinds = [c for c in kinds if c.name in again or c.name not in traced]
    kept: Columns = {}
    traces = Traces(LARGEST // len(linear.clusters))
    first = scores(linear, kinds, kept, traces)
    first = _with_placebo(linear, first, kept)
    tried = scores(linear, [c for s in _first_of_each(first) for c in _more(s)], traces=traces)
    best = _best([*first, *tried])
    hints = [s.candidate for s in best[:RESHAPED] if s.log_likelihood_gain > HINT]
    shaped = scores(linear, [c for hint in hints for c in reshaped(hint)], traces=traces)
    return Screening(_with_typical(first, [*best, *shaped]), _tests(first, tried, before), traces)


def _with_typical(first: Sequence[Score], best: Sequence[Score]) -> list[Score]:
    """Return the best of each effect, with what it is worth at its typical size."""
    typical: dict[str, float] = {}
    for s in first:
        typical[s.candidate.name] = max(typical.get(s.candidate.name, 0.0), s.visible_gain)
    return [replace(s, typical=typical[s.candidate.name]) for s in _best(best)]


def _tests(first: Sequence[Score], tried: Sequence[Score], before: Screening | None) -> int:
    """Count the effects that could have been found by chance, in the whole library."""
    told_of = [s.candidate for s in (*first, *tried) if s.visible_gain > CHANCE]
    chances = {_start(c) for c in told_of} & {_start(s.candidate) for s in first}
    tests = TRIES * max(len(chances), 1)
    return tests if before is None else max(tests, before.tests)


def _start(c: Candidate) -> tuple[Effect, tuple[float, ...], tuple[float, ...]]:
    """Return all of a try but its size."""
    return c.pattern, c.integers, c.parameters[1:]


def as_known(candidate: Candidate, model: Model) -> Candidate:
    """Return the candidate with what the file states of it, or the recordings show plainly.

    They show the steps of a channel.
    """
    candidate = beside_the_file(candidate, model.system)
    if not isinstance(candidate.pattern, Rounds):
        return candidate
    sensors = [
        r.sensors[candidate.pattern.subject]
        for r in model.records
        if candidate.pattern.subject in r.sensors
    ]
    steps = [s.quantization.step for s in sensors if s.coarse]
    return fixed_from_data(candidate, float(np.median(steps))) if steps else candidate


def at_other_places(
    found: Candidate, library: Iterable[type[Effect]], model: Model
) -> Iterator[Candidate]:
    """Yield the same effect, with the same dials, at every other place where it may act."""
    there = {c.name: c for c in of_one_kind(found, library) if same_try(c, found)}
    for other in there.values():
        if other.name != found.name:
            yield as_known(replace(other, parameters=found.parameters).within(), model)


def of_one_kind(found: Candidate, library: Iterable[type[Effect]]) -> Iterator[Candidate]:
    """Yield all tries of effects of the same name, at every place where it may act."""
    for kind in library:
        if kind.name == found.kind.name:
            yield from candidates(kind)


def _with_placebo(linear: Linearization, found: Sequence[Score], kept: Columns) -> list[Score]:
    """Tell what is looked for along the road how its size scatters where it cannot be true."""
    along: dict[str, list[Candidate]] = {}
    for score in found:
        if place_on_the_road(score.candidate.pattern) is not None:
            along.setdefault(score.candidate.name, []).append(score.candidate)
    tried = {name: placebo_locations(linear, places, kept) for name, places in along.items()}
    return [_held_to(score, tried) for score in found]


def _held_to(score: Score, tried: Mapping[str, Sequence[PlaceboLocation]]) -> Score:
    at = place_on_the_road(score.candidate.pattern)
    if at is None:
        return score
    scatter = usual(tried[score.candidate.name], at)
    return replace(score, candidate=replace(score.candidate, placebo=scatter))


def _first_of_each(found: Iterable[Score]) -> Iterator[Score]:
    """Yield the tries of each effect that show the most, with either sign."""
    by_name: dict[str, list[Score]] = {}
    for score in found:
        by_name.setdefault(score.candidate.name, []).append(score)
    for tries in by_name.values():
        yield from sorted(tries, key=lambda s: (-s.visible_gain * s.amplitude**2, -s.visible_gain))[
            :STARTS
        ]


def _more(score: Score) -> list[Candidate]:
    """Return the tries that a first score asks for."""
    here, backwards = score.candidate, score.amplitude < 0.0
    if score.visible_gain < SHOWN:
        return list(larger(here))
    small = list(_small(score))
    if score.visible_gain * score.amplitude**2 <= HINT:
        return small
    turned = list(half_turn_shifted(here)) if backwards else []
    others = [*small, *otherwise(here, backwards)]
    return others + [c for t in turned for c in (t, *otherwise(t, backwards=False))]


def _small(score: Score) -> Iterator[Candidate]:
    """Yield the candidate at the size at which it would show plainly, where that is far smaller."""
    here = score.candidate
    if score.visible_gain > BEYOND * PLAIN and not limits(here.kind):
        share = math.sqrt(PLAIN / score.visible_gain)
        yield here.amplified(share)


def _credit(score: Score) -> tuple[float, float]:
    """Order of the tries of one effect: signatures hold near the size at which they were taken."""
    near = NEAR[0] < score.amplitude < NEAR[1]
    return (
        score.log_likelihood_gain if near else OFF * score.log_likelihood_gain
    ), score.visible_gain


def _best(scores: Iterable[Score]) -> list[Score]:
    found: dict[str, Score] = {}
    for score in scores:
        name = score.candidate.name
        if name not in found or _credit(score) > _credit(found[name]):
            found[name] = score
    return by_log_likelihood_gain(found.values())


def by_log_likelihood_gain(scores: Iterable[Score]) -> list[Score]:
    """Return scores, greatest gain first."""
    return sorted(scores, key=lambda s: -s.log_likelihood_gain)
