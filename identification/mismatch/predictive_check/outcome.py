"""Whether two verdicts give the same answer."""

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
    """An answer beside the one that is checked.

    place: the same, or that of an effect which cannot be told apart from an accepted one. effects: of the accepted ones, named again or not. inside, intervals: how many intervals contain
    the simulated parameter, of how many.
    """

    names: tuple[str, ...]
    same: bool
    place: bool
    effects: Mapping[str, bool]
    inside: int = 0
    intervals: int = 0


def key_of(effect: FoundEffect) -> str:
    """Name of an effect with its subject."""
    return f"{effect.name}.{effect.subject}" if effect.subject else effect.name


@dataclass(frozen=True)
class Answer:
    """What an analysis concluded, and the places where what it found acts."""

    verdict: Verdict
    places: frozenset[str]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the accepted effects; UNKNOWN for a mismatch without a sufficient name."""
        found = self.verdict
        if found.mismatch and (found.unknown or not found.effects):
            return (UNKNOWN,)
        return tuple(key_of(e) for e in found.effects)


def answer_of(a: Analysis, verdict: Verdict) -> Answer:
    """Answer of an analysis: where its effects act, or where a free curve does."""
    if verdict.effects and a.named is not None:
        patterns = [c.pattern for c in a.named.fit.effects]
        places = (a.system.acts_at(p) or p.subject.partition("/")[0] for p in patterns)
        return Answer(verdict, frozenset(places))
    where = verdict.location
    return Answer(verdict, frozenset([where.injection] if where and verdict.mismatch else []))


def compared(first: Answer, again: Answer, truth: Mapping[str, Effect]) -> Compared:
    """Compare an answer with the one that is checked. truth: simulated effects by name."""
    classes = (*first.verdict.equivalents, *again.verdict.equivalents)
    inside, intervals = _inside(again.verdict, truth)
    same = _matches(first.names, again.names, classes)
    by_another = same and set(first.names) != set(again.names)
    return Compared(
        again.names,
        same,
        by_another or first.places == again.places,
        {n: any(alike(n, other, classes) for other in again.names) for n in first.names},
        inside,
        intervals,
    )


def alike(one: str, other: str, classes: Sequence[Sequence[str]]) -> bool:
    """Tell whether two names are one, or in one class that recordings cannot tell apart."""
    return one == other or any({one, other} <= _members(names) for names in classes)


def _members(names: Sequence[str]) -> set[str]:
    """Single names of a class; of a pair that was named at once, the one that others replace."""
    return {name.rpartition(" + ")[2] for name in names}


def _matches(wanted: Sequence[str], named: Sequence[str], classes: Sequence[Sequence[str]]) -> bool:
    return len(wanted) == len(named) and any(
        all(alike(a, b, classes) for a, b in zip(wanted, order, strict=True))
        for order in permutations(named)
    )


def _inside(again: Verdict, truth: Mapping[str, Effect]) -> tuple[int, int]:
    told = [
        (p, float(getattr(truth[key_of(e)], p.name)))
        for e in again.effects
        if key_of(e) in truth
        for p in e.parameters
        if p.high > p.low
    ]
    return sum(p.low <= value <= p.high for p, value in told), len(told)


def simulated_effects(fit: Fit) -> dict[str, Effect]:
    """Effects that a simulation contained beside those of its file, by name."""
    return {c.name: c.effect() for c in fit.candidates if isinstance(c, Candidate)}
