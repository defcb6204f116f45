"""Score tests of candidate effects: the gain expected from each without fitting it."""

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
    TESTS_PER_EFFECT,
    candidates,
    half_turn_shifted,
    larger,
    other_sizes,
    place_in_record,
    reshaped,
    same_candidate,
)
from slipbench.identification.mismatch.naming.placebo import (
    PlaceboLocation,
    at_places,
    placebo_inflation,
)
from slipbench.identification.mismatch.naming.rescreen import AGAIN, promising_again
from slipbench.identification.mismatch.naming.score_tests import batches, score_tests
from slipbench.identification.mismatch.naming.traces import Traces
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.simulation.sensor import Quantizes
from slipbench.identification.mismatch.thresholds import EXCITED, TESTABLE
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

HINT = 0.5
"""Gain of an amplitude, either sign, above which more candidates of an effect are tested, nats."""
NEAR = (0.3, 3.0)
"""Amplitudes for which a response is valid."""
MOST = 2.0
"""Largest amplitude at which a fit begins: the response of a limit is nonlinear before it
triples."""
WHOLE = 0.5
"""Share of a response outside the nuisances above which its amplitude is certain."""
OFF = 0.7
"""Weight of a gain at other amplitudes."""
PLAIN = 50.0
"""Expected gain of an effect at the small trial size, nats."""
BEYOND = 20.0
"""Multiple of that gain above which the typical size is too far from the small one."""
STARTS = 3
"""Candidates of one effect at its typical size, at other locations or angles, that are varied
further."""
RESHAPED = 8
NEXT_TO_NOTHING = 1e-9


@dataclass(frozen=True)
class Score:
    """Score test of a candidate's response against the residual.

    amplitude: of the response, 1 = as large as tested. log_likelihood_gain: nats. visible_gain:
    gain if the effect were present as tested, nats. kept: share of the response that calibration
    cannot absorb. p: one-sided, against a negligible amplitude. typical: largest `visible_gain` of
    the effect's candidates at their typical size.
    """

    candidate: Candidate
    amplitude: float
    log_likelihood_gain: float
    visible_gain: float
    kept: float
    p: float
    typical: float = 0.0

    @property
    def is_negligible(self) -> bool:
        """Whether the effect is negligible, even NEAR[1] times as large as scored.

        Only where calibration absorbs little of its response: elsewhere its size is uncertain.
        """
        largest = NEAR[1] * abs(self.amplitude * self.candidate.added)
        return self.kept > WHOLE and largest < self.candidate.negligible_difference

    def as_large_as_scored(self) -> Candidate:
        """Return the candidate at its scored size, within the validity of its response."""
        return self.candidate.amplified(min(max(self.amplitude, NEAR[0]), MOST))


Columns = dict[Candidate, Floats]
"""Responses of candidates, (rows,) each."""


def scores(
    linear: Linearization,
    candidates: Sequence[Candidate],
    kept: Columns | None = None,
    traces: Traces | None = None,
) -> list[Score]:
    """Score candidates at their sizes.

    kept: receives the responses of candidates with placebo locations, shape (rows,) each; traces:
    receives the changes of the best candidates.
    """
    scored: list[Score] = []
    for batch in batches(linear, candidates):
        changes = linear.changes(batch)
        columns = linear.whitened(changes)
        tested = _tested(linear, batch, columns)
        scored += tested
        for score, column, changed in zip(tested, columns.T, changes, strict=True):
            if kept is not None and place_in_record(score.candidate.pattern) is not None:
                kept[score.candidate] = column.copy()
            if traces is not None and score.visible_gain > TESTABLE:
                traces.add(score.candidate, _credit(score), changed)
    return scored


def _tested(linear: Linearization, candidates: Sequence[Candidate], columns: Floats) -> list[Score]:
    """Score candidates by their responses, (rows, candidates), in one batch."""
    tests = score_tests(linear, columns)
    p = np.ones(len(candidates))
    hints = np.flatnonzero(tests.visible & (tests.log_likelihood_gain > HINT))
    projected = linear.nuisances.subtract(columns[:, hints], tests.hidden[:, hints])
    for i, response in zip(hints, np.ascontiguousarray(projected.T), strict=True):
        negligible = candidates[int(i)].negligible_difference / max(
            abs(candidates[int(i)].added), NEXT_TO_NOTHING
        )
        p[i] = amplitude_p(
            response, linear.residuals, linear.clusters, linear.fit.variance_inflation, negligible
        )
    return [
        Score(c, float(a), float(g), 0.5 * float(e), float(e / w), float(p_value))
        if shown
        else Score(c, 0.0, 0.0, 0.0, 0.0, 1.0)
        for c, a, g, e, w, p_value, shown in zip(
            candidates,
            tests.amplitude,
            tests.log_likelihood_gain,
            tests.energy,
            tests.whole_energy,
            p,
            tests.visible,
            strict=True,
        )
    ]


def placebo_locations(
    linear: Linearization, places: Sequence[Candidate], kept: Columns | None = None
) -> list[PlaceboLocation]:
    """Return the result of each trial alone for one effect at several locations.

    kept: responses of these candidates, shape (rows,) each, where they are known already.
    """
    known = {} if kept is None else kept
    missing = [p for p in places if p not in known]
    computed = (
        dict(zip(missing, linear.effect_responses(missing).T, strict=True)) if missing else {}
    )
    columns = np.stack([known[p] if p in known else computed[p] for p in places], axis=1)
    trial = recordings(linear.fit.model)
    by_trial = [linear.energy_and_correlation(columns, trial == r) for r in np.unique(trial)]
    length = np.sqrt(np.sum(columns**2, axis=0)) + 1e-300
    positions = [place_in_record(p.pattern) or 0.0 for p in places]
    energy, correlation = (np.stack(x) for x in zip(*by_trial, strict=True))
    normalized = columns / length
    alike = normalized.T @ normalized
    return at_places(positions, energy, correlation / np.maximum(energy, 1e-300), alike)


@dataclass(frozen=True, eq=False)
class Screening:
    """scores: the best candidate of every effect, largest gain first.

    tests: number of independent tests. traces: changes of the outputs by the best candidates of
    each.
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
    """Score every effect on every subject where it is not accepted yet.

    An effect that the file states is scored for a change of its size. All are tested at their
    typical size. Those above HINT are tested at other sizes and shapes as well; those without
    sufficient response at their typical size, at a large one; those with a very large response, at
    a small one, since a response is valid only near its own size. before: a screening of another
    fit of the same recordings. If the responses there are still valid, they select the effects
    screened here; effects without a response there are screened too. most: largest number of
    selected effects.
    """
    accepted = {c.name for c in linear.fit.effects}
    teeth = {disc.block: angles.size for disc, angles in discs(linear.fit)}
    known = (as_known(c, linear.fit.model) for kind in library for c in candidates(kind, teeth))
    kinds = [c for c in known if c.name not in accepted]
    selected = promising_again(linear, before.traces, most) if before is not None else None
    if before is not None and selected is not None:
        traced = before.traces.names()
        kinds = [c for c in kinds if c.name in selected or c.name not in traced]
    kept: Columns = {}
    traces = Traces(LARGEST // len(linear.clusters))
    typical = scores(linear, kinds, kept, traces)
    typical = _with_placebo(linear, typical, kept)
    varied = scores(
        linear,
        [c for s in _strongest_of_each(typical) for c in _further_candidates(s)],
        traces=traces,
    )
    best = _best([*typical, *varied])
    hints = [s.candidate for s in best[:RESHAPED] if s.log_likelihood_gain > HINT]
    shaped = scores(linear, [c for hint in hints for c in reshaped(hint)], traces=traces)
    return Screening(
        _with_typical(typical, [*best, *shaped]), _tests(typical, varied, before), traces
    )


def _with_typical(at_typical_size: Sequence[Score], best: Sequence[Score]) -> list[Score]:
    """Return the best of each effect, with its expected gain at its typical size."""
    typical: dict[str, float] = {}
    for s in at_typical_size:
        typical[s.candidate.name] = max(typical.get(s.candidate.name, 0.0), s.visible_gain)
    return [replace(s, typical=typical[s.candidate.name]) for s in _best(best)]


def _tests(typical: Sequence[Score], varied: Sequence[Score], before: Screening | None) -> int:
    """Count the independent tests with sufficient power in the whole library."""
    powerful = [s.candidate for s in (*typical, *varied) if s.visible_gain > TESTABLE]
    independent = {_without_size(c) for c in powerful} & {
        _without_size(s.candidate) for s in typical
    }
    tests = TESTS_PER_EFFECT * max(len(independent), 1)
    return tests if before is None else max(tests, before.tests)


def _without_size(c: Candidate) -> tuple[Effect, tuple[float, ...], tuple[float, ...]]:
    """Return all attributes of a candidate except its size."""
    return c.pattern, c.integers, c.parameters[1:]


def as_known(candidate: Candidate, model: Model) -> Candidate:
    """Return the candidate with what the file states of it, or the recordings determine directly.

    Recordings determine the quantization step of a channel.
    """
    candidate = beside_the_file(candidate, model.system)
    if not isinstance(candidate.pattern, Quantizes):
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
    """Yield the same effect and parameters at every other location where it may act."""
    same = {c.name: c for c in of_one_kind(found, library) if same_candidate(c, found)}
    for other in same.values():
        if other.name != found.name:
            yield as_known(replace(other, parameters=found.parameters).within(), model)


def of_one_kind(found: Candidate, library: Iterable[type[Effect]]) -> Iterator[Candidate]:
    """Yield all candidates of effects of the same name, at every location."""
    for kind in library:
        if kind.name == found.kind.name:
            yield from candidates(kind)


def _with_placebo(linear: Linearization, scored: Sequence[Score], kept: Columns) -> list[Score]:
    """Add the variance inflation of placebo locations to candidates with other locations."""
    by_name: dict[str, list[Candidate]] = {}
    for score in scored:
        if place_in_record(score.candidate.pattern) is not None:
            by_name.setdefault(score.candidate.name, []).append(score.candidate)
    locations = {name: placebo_locations(linear, places, kept) for name, places in by_name.items()}
    return [_with_inflation(score, locations) for score in scored]


def _with_inflation(score: Score, locations: Mapping[str, Sequence[PlaceboLocation]]) -> Score:
    position = place_in_record(score.candidate.pattern)
    if position is None:
        return score
    inflation = placebo_inflation(locations[score.candidate.name], position)
    return replace(score, candidate=replace(score.candidate, placebo=inflation))


def _strongest_of_each(scored: Iterable[Score]) -> Iterator[Score]:
    """Yield the candidates of each effect with the largest gain, of either sign."""
    by_name: dict[str, list[Score]] = {}
    for score in scored:
        by_name.setdefault(score.candidate.name, []).append(score)
    for same_name in by_name.values():
        yield from sorted(
            same_name, key=lambda s: (-s.visible_gain * s.amplitude**2, -s.visible_gain)
        )[:STARTS]


def _further_candidates(score: Score) -> list[Candidate]:
    """Return the further candidates to test after a first score."""
    candidate, backwards = score.candidate, score.amplitude < 0.0
    if score.visible_gain < EXCITED:
        return list(larger(candidate))
    small = list(_small(score))
    if score.visible_gain * score.amplitude**2 <= HINT:
        return small
    shifted = list(half_turn_shifted(candidate)) if backwards else []
    others = [*small, *other_sizes(candidate, backwards)]
    return others + [c for one in shifted for c in (one, *other_sizes(one, backwards=False))]


def _small(score: Score) -> Iterator[Candidate]:
    """Yield the candidate at the size of sufficient response, if that is far smaller."""
    candidate = score.candidate
    if score.visible_gain > BEYOND * PLAIN and not limits(candidate.kind):
        share = math.sqrt(PLAIN / score.visible_gain)
        yield candidate.amplified(share)


def _credit(score: Score) -> tuple[float, float]:
    """Sort key of the candidates of one effect: responses are valid near their own size."""
    near = NEAR[0] < score.amplitude < NEAR[1]
    return (
        score.log_likelihood_gain if near else OFF * score.log_likelihood_gain
    ), score.visible_gain


def _best(scores: Iterable[Score]) -> list[Score]:
    best: dict[str, Score] = {}
    for score in scores:
        name = score.candidate.name
        if name not in best or _credit(score) > _credit(best[name]):
            best[name] = score
    return by_log_likelihood_gain(best.values())


def by_log_likelihood_gain(scores: Iterable[Score]) -> list[Score]:
    """Return scores, largest gain first."""
    return sorted(scores, key=lambda s: -s.log_likelihood_gain)
