"""Candidates of an effect: subjects, locations, integer values; other sizes, angles and shapes."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.candidate import Candidate
from slipbench.identification.mismatch.fit.sizing import (
    integer_parameters,
    shapes,
    sizes,
    trial_sizes,
)
from slipbench.plant.effects.effect import Effect
from slipbench.plant.parameters import Parameter

TESTS_PER_EFFECT = 3
NO_DISCS: Mapping[str, int] = {}
ROAD, TIME = "m", "s"
MOST_WHOLE = 48
ABOUT = 3
QUARTER = 2.0
"""Prior deviations of an angle that make a quarter turn; 4 are half a turn (see `sizing.shaped`),
the end of its range."""
NEARLY_HALF = 3.6


def candidates(kind: type[Effect], teeth: Mapping[str, int] = NO_DISCS) -> Iterator[Candidate]:
    """Yield an effect at its typical size and shape, on every subject and at every location.

    Effects with a full-circle angle are tested at two angles, a quarter turn apart: a line in
    quadrature to a single tested one would have no correlation with it, however large it is. teeth:
    number of teeth of every recorded toothed disc, by its subject.
    """
    for pattern in (p for c in kind.candidates() for p in _located(c)):
        for integers in _integer_values(kind, teeth.get(pattern.subject, 1)):
            first = Candidate(pattern, (1.0, *([0.0] * len(shapes(kind)))), integers)
            yield first
            yield from (_with_angle(first, angle, QUARTER) for angle in _full_circle_angles(kind))


def other_sizes(candidate: Candidate, backwards: bool) -> Iterator[Candidate]:
    """Yield the candidate at its other trial sizes; backwards: with the opposite sign."""
    sign = -1.0 if backwards and _signed(candidate.kind) else 1.0
    for size in trial_sizes(candidate.kind):
        if sign * size != candidate.size:
            yield candidate.resized(sign * size)


def half_turn_shifted(candidate: Candidate) -> Iterator[Candidate]:
    """Yield the candidate with each full-circle angle shifted by nearly half a turn, either way.

    An effect whose size cannot be negative has its opposite there.
    """
    for angle in _full_circle_angles(candidate.kind):
        for offset in (-NEARLY_HALF, NEARLY_HALF):
            if abs(candidate.parameters[angle] + offset) <= NEARLY_HALF:
                yield _with_angle(candidate, angle, offset)


def _full_circle_angles(kind: type[Effect]) -> list[int]:
    """Return the indices of parameters that are angles with a range of a full turn."""
    return [
        i
        for i, p in enumerate(shapes(kind), start=1)
        if p.unit == "rad" and math.isclose(p.high - p.low, 2.0 * math.pi, rel_tol=1e-3)
    ]


def _with_angle(candidate: Candidate, angle: int, offset: float) -> Candidate:
    parameters = list(candidate.parameters)
    parameters[angle] += offset
    return replace(candidate, parameters=tuple(parameters))


def larger(candidate: Candidate) -> Iterator[Candidate]:
    """Yield the candidate at the trial sizes beyond the typical one."""
    for size in trial_sizes(candidate.kind):
        if size > 1.0:
            yield candidate.resized(size)


def reshaped(candidate: Candidate) -> Iterator[Candidate]:
    """Yield the candidate with each shape parameter at other values of its range."""
    for i in range(1, len(candidate.parameters)):
        for y in (-2.0, -1.0, 1.0, 2.0):
            parameters = (*candidate.parameters[:i], y, *candidate.parameters[i + 1 :])
            yield replace(candidate, parameters=parameters).within()


def same_candidate(one: Candidate, other: Candidate) -> bool:
    """Return whether candidates of one effect differ only in subject and fitted parameters."""
    return one.integers == other.integers and all(
        getattr(one.pattern, p.name) == getattr(other.pattern, p.name) for p in shapes(other.kind)
    )


def place_in_record(pattern: Effect) -> float | None:
    """Return where on the road, or at what period, an effect acts; None if it has neither.

    In steps of the search.
    """
    for p in pattern.parameters():
        if p.sought and p.unit in (ROAD, TIME):
            steps = np.arange(len(p.sought))
            return float(np.interp(getattr(pattern, p.name), p.sought, steps))
    return None


def _located(pattern: Effect) -> Iterator[Effect]:
    """Yield an effect at every location tested."""
    for p in pattern.parameters():
        if p.sought:
            yield from (replace(pattern, **{p.name: position}) for position in p.sought)
            return
    yield pattern


def _integer_values(kind: type[Effect], teeth: int) -> list[tuple[float, ...]]:
    values: list[tuple[float, ...]] = [()]
    for p in integer_parameters(kind):
        values = [(*v, n) for v in values for n in _tested_values(kind, p, teeth)]
    return values


def _tested_values(kind: type[Effect], p: Parameter, teeth: int) -> list[float]:
    """Tested values of an integer parameter.

    Every tooth or order; a few around a typical count; a single seed.
    """
    if hasattr(kind, "tooth_offsets"):
        # Teeth count from 0. Orders count from 1; those above half the teeth are aliases of lower
        # ones, and at half the teeth size and phase cannot be distinguished.
        largest = teeth if p.low < 1.0 else max((teeth - 1) // 2, 1)
        return [p.low + i for i in range(largest) if p.low + i <= p.high]
    if p.high > MOST_WHOLE**2:
        return [p.typical]
    near = (p.typical + i for i in range(-ABOUT, ABOUT + 1))
    return [n for n in near if p.low <= n <= p.high]


def _signed(kind: type[Effect]) -> bool:
    return any(p.low < p.absent < p.high and not math.isinf(p.absent) for p in sizes(kind))
