"""Compare the results of two analyses."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

from slipbench.identification.mismatch.analysis import Analysis
from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.reporting.verdict import FoundEffect, Verdict
from slipbench.plant.effects.effect import Effect

UNKNOWN = "unknown effect"


@dataclass(frozen=True)
class Compared:
    """Result of a repeated analysis, compared with the result that is checked.

    same: the same effects, or indistinguishable ones. place: the same injection points, or those of
    indistinguishable effects. effects: whether each accepted effect was named again. inside:
    number of intervals that contain the simulated parameter; intervals: number of all intervals.
    """

    names: tuple[str, ...]
    same: bool
    place: bool
    effects: Mapping[str, bool]
    inside: int = 0
    intervals: int = 0


def key_of(effect: FoundEffect) -> str:
    """Return the name of an effect with its subject."""
    return f"{effect.name}.{effect.subject}" if effect.subject else effect.name


@dataclass(frozen=True)
class AnalysisResult:
    """Verdict of an analysis, and the injection points of its effects or its free curve."""

    verdict: Verdict
    places: frozenset[str]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the accepted effects; UNKNOWN for a mismatch that no effect explains."""
        result = self.verdict
        if result.mismatch and (result.unknown or not result.effects):
            return (UNKNOWN,)
        return tuple(key_of(e) for e in result.effects)


def result_of(a: Analysis, verdict: Verdict) -> AnalysisResult:
    """Return the result of an analysis, with the places where its effects or its curve act."""
    if verdict.effects and a.named is not None:
        patterns = [c.pattern for c in a.named.fit.effects]
        places = (a.system.acts_at(p) or p.subject.partition("/")[0] for p in patterns)
        return AnalysisResult(verdict, frozenset(places))
    location = verdict.location
    return AnalysisResult(
        verdict, frozenset([location.injection] if location and verdict.mismatch else [])
    )


def compare(first: AnalysisResult, again: AnalysisResult, truth: Mapping[str, Effect]) -> Compared:
    """Compare a repeated result with the first one. truth: simulated effects by name."""
    classes = (*first.verdict.equivalents, *again.verdict.equivalents)
    contained, intervals = _count_inside(again.verdict, truth)
    same = _matches(first.names, again.names, classes)
    under_other_names = same and set(first.names) != set(again.names)
    return Compared(
        again.names,
        same,
        under_other_names or first.places == again.places,
        {
            n: any(indistinguishable(n, other, classes) for other in again.names)
            for n in first.names
        },
        contained,
        intervals,
    )


def indistinguishable(one: str, other: str, classes: Sequence[Sequence[str]]) -> bool:
    """Return whether two names are equal, or in one class of indistinguishable names."""
    return one == other or any({one, other} <= _single_names(names) for names in classes)


def _single_names(names: Sequence[str]) -> set[str]:
    """Return the single names of a class; of a pair "a + b", the second, which others replace."""
    return {name.rpartition(" + ")[2] for name in names}


def _matches(
    expected: Sequence[str], identified: Sequence[str], classes: Sequence[Sequence[str]]
) -> bool:
    return len(expected) == len(identified) and any(
        all(indistinguishable(a, b, classes) for a, b in zip(expected, permutation, strict=True))
        for permutation in permutations(identified)
    )


def _count_inside(again: Verdict, truth: Mapping[str, Effect]) -> tuple[int, int]:
    estimates = [
        (p, float(getattr(truth[key_of(e)], p.name)))
        for e in again.effects
        if key_of(e) in truth
        for p in e.parameters
        if p.high > p.low
    ]
    return sum(p.low <= true_value <= p.high for p, true_value in estimates), len(estimates)


def simulated_effects(fit: Fit) -> dict[str, Effect]:
    """Return the effects of a simulation that its file does not contain, by name."""
    return {c.name: c.effect() for c in fit.candidates if isinstance(c, Candidate)}
