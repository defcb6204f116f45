"""What is tried of an effect: subjects, places, whole numbers; other sizes, angles, shapes."""

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

TRIES = 3
NO_DISCS: Mapping[str, int] = {}
ROAD = "m"
MOST_WHOLE = 48
ABOUT = 3
QUARTER = 2.0
"""Prior deviations of an angle; 4 are half a turn (see `sizing.shaped`), where its range ends."""
NEARLY_HALF = 3.6


def candidates(kind: type[Effect], teeth: Mapping[str, int] = NO_DISCS) -> Iterator[Candidate]:
    """Yield an effect at its typical size and shape, on every subject; once and more.

    What goes all round is tried at two angles, a quarter apart: a line in quadrature to the only
    one that is tried shows nothing there, however large it is. teeth: of every toothed disc that
    was recorded, by its subject.
    """
    for pattern in (p for c in kind.candidates() for p in _sought(c)):
        for whole in _whole_values(kind, teeth.get(pattern.subject, 1)):
            first = Candidate(pattern, (1.0, *([0.0] * len(shapes(kind)))), whole)
            yield first
            yield from (_with_angle(first, angle, QUARTER) for angle in _all_round(kind))


def otherwise(candidate: Candidate, backwards: bool) -> Iterator[Candidate]:
    """Yield the candidate at the other sizes that are tried; backwards: with the other sign."""
    sign = -1.0 if backwards and _both_ways(candidate.kind) else 1.0
    for size in trial_sizes(candidate.kind):
        if sign * size != candidate.size:
            yield candidate.resized(sign * size)


def half_turn_shifted(candidate: Candidate) -> Iterator[Candidate]:
    """Yield the candidate with each angle that goes all round turned by nearly half, either way.

    What cannot be less than nothing shows its opposite there.
    """
    for angle in _all_round(candidate.kind):
        for by in (-NEARLY_HALF, NEARLY_HALF):
            if abs(candidate.parameters[angle] + by) <= NEARLY_HALF:
                yield _with_angle(candidate, angle, by)


def _all_round(kind: type[Effect]) -> list[int]:
    """Return the dials that are angles and go all round."""
    return [
        i
        for i, p in enumerate(shapes(kind), start=1)
        if p.unit == "rad" and math.isclose(p.high - p.low, 2.0 * math.pi, rel_tol=1e-3)
    ]


def _with_angle(candidate: Candidate, angle: int, by: float) -> Candidate:
    parameters = list(candidate.parameters)
    parameters[angle] += by
    return replace(candidate, parameters=tuple(parameters))


def larger(candidate: Candidate) -> Iterator[Candidate]:
    """Yield the candidate at the tried sizes beyond the typical one."""
    for size in trial_sizes(candidate.kind):
        if size > 1.0:
            yield candidate.resized(size)


def reshaped(candidate: Candidate) -> Iterator[Candidate]:
    """Yield the candidate with each shaping parameter at other places of its range."""
    for i in range(1, len(candidate.parameters)):
        for y in (-2.0, -1.0, 1.0, 2.0):
            there = (*candidate.parameters[:i], y, *candidate.parameters[i + 1 :])
            yield replace(candidate, parameters=there).within()


def same_try(one: Candidate, other: Candidate) -> bool:
    """Tell whether two are tries of one effect that differ in nothing but subject and dials."""
    return one.integers == other.integers and all(
        getattr(one.pattern, p.name) == getattr(other.pattern, p.name) for p in shapes(other.kind)
    )


def place_on_the_road(pattern: Effect) -> float | None:
    """Return where an effect is looked for, in steps of the search; None: on no road."""
    for p in pattern.parameters():
        if p.sought is not None and p.unit == ROAD:
            return float(getattr(pattern, p.name)) / p.sought[2]
    return None


def _sought(pattern: Effect) -> Iterator[Effect]:
    """Yield an effect at every place at which it is looked for."""
    for p in pattern.parameters():
        if p.sought is not None:
            first, last, step = p.sought
            for place in np.arange(first, last, step):
                yield replace(pattern, **{p.name: float(place)})
            return
    yield pattern


def _whole_values(kind: type[Effect], teeth: int) -> list[tuple[float, ...]]:
    values: list[tuple[float, ...]] = [()]
    for p in integer_parameters(kind):
        values = [(*v, n) for v in values for n in _meant(kind, p, teeth)]
    return values


def _meant(kind: type[Effect], p: Parameter, teeth: int) -> list[float]:
    """Values of a whole parameter: every tooth or order; a few about a typical count; one seed."""
    if hasattr(kind, "tooth_offsets"):
        # Teeth count from 0; of orders, from 1, those beyond half the teeth look like lower ones,
        # and at half of them size and phase are one number.
        most = teeth if p.low < 1.0 else max((teeth - 1) // 2, 1)
        return [p.low + i for i in range(most) if p.low + i <= p.high]
    if p.high > MOST_WHOLE**2:
        return [p.typical]
    near = (p.typical + i for i in range(-ABOUT, ABOUT + 1))
    return [n for n in near if p.low <= n <= p.high]


def _both_ways(kind: type[Effect]) -> bool:
    return any(p.low < p.absent < p.high and not math.isinf(p.absent) for p in sizes(kind))
