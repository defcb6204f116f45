"""An effect of the library as something that can be turned up from nothing, and fitted.

Its size is told in shares of the typical one: 0 absent, 1 typical. Effects that limit (absent at
infinity) grow as their limit falls: size = typical / limit. Parameters that only shape an effect
keep near their typical value; whole numbers are tried one after the other, and so is every channel
or wheel that may have the effect.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from identification.mismatch.fit.scatter import Scatter
from plant.effects.effect import Effect
from plant.parameters import Parameter
from plant.signals import Floats

LARGE = 3.0
"""Largest share of the typical size at which every effect is tried."""
STEPS = (1.25, 1.6, 2.2)
"""Further shares of the typical size at which limits are tried."""
TRIES = 3
SHAPE = math.log(1.6)
"""Prior deviation of a shaping parameter's logarithm."""
MOST_WHOLE = 48
NUDGE = 0.05  # of a size, or of a shape's prior deviation
WEAK = 1e3  # prior deviation of a size, in typical sizes: none to speak of
SHARE_OF_SMALL = 0.1
"""Effects below this share of the smallest size of interest do not count."""
OF_DISCS = 0.5
"""The same for toothed discs, which are all cut with some tolerance."""
ABOUT = 3
NEARLY_HALF = 3.6
"""Prior deviations of an angle; 4 are half of a turn (see `_shaped`), where its range ends."""


class Dialled(ABC):
    """Something missing that can be turned up from nothing. dials: what is fitted, free numbers.

    elsewhere: how its size scatters over other places at which it is looked for, if it has any.
    answers: what a unit of each dial brings in the outputs, (T, m, dials) by block and record,
    where that is known beforehand; else it is measured by nudging.
    """

    dials: tuple[float, ...]
    elsewhere: Scatter | None = None
    answers: list[list[Floats]] | None = None

    @property
    @abstractmethod
    def name(self) -> str:
        """Its word."""

    @property
    @abstractmethod
    def deviations(self) -> tuple[float, ...]:
        """Prior deviation of every dial."""

    @property
    @abstractmethod
    def nudges(self) -> tuple[float, ...]:
        """Small steps by which the dials' effect is measured."""

    @abstractmethod
    def effect(self) -> Effect:
        """Return the effect at these dials."""

    @abstractmethod
    def moved(self, step: Floats) -> Self:
        """Return it with its dials turned."""


@dataclass(frozen=True)
class Candidate(Dialled):
    """An effect with the values of its dials: first the size, then what shapes it.

    pattern: the effect on its subject, at its typical size, where it is looked for. dials: size in
    typical sizes, shapes as unit normals. whole: values of whole parameters. elsewhere: how its
    size scatters over other places at which it is looked for, if it has any. read_off: its size is
    read off the recordings, and no fit of what is left tells it better.
    """

    pattern: Effect
    dials: tuple[float, ...]
    whole: tuple[float, ...] = ()
    elsewhere: Scatter | None = None
    read_off: bool = False

    @property
    def kind(self) -> type[Effect]:
        """The effect's class."""
        return type(self.pattern)

    @property
    def name(self) -> str:
        """The effect's word, with its subject."""
        return self.pattern.key

    @property
    def deviations(self) -> tuple[float, ...]:
        """A size has none to speak of."""
        return (WEAK, *([1.0] * (len(self.dials) - 1)))

    @property
    def nudges(self) -> tuple[float, ...]:
        """In proportion to the size; backwards where a parameter is at the end of its range."""
        steps = (NUDGE * self.size, *([NUDGE] * (len(self.dials) - 1)))
        if not self._kept:
            return steps
        turned = (self.moved(s * np.eye(len(steps))[i]) for i, s in enumerate(steps))
        now = self.effect()
        return tuple(-s if t.effect() == now else s for s, t in zip(steps, turned, strict=True))

    @property
    def _kept(self) -> bool:
        """Whether its size stays within the range of its parameters, where it can be felt."""
        return hasattr(self.kind, "keeps_in_range")

    @property
    def counts(self) -> float:
        """Size below which it does not count, in shares of the typical one."""
        share = OF_DISCS if hasattr(self.kind, "tooth_offsets") else SHARE_OF_SMALL
        return share * self.smallest

    @property
    def size(self) -> float:
        """Share of the typical size."""
        return self.dials[0]

    @property
    def smallest(self) -> float:
        """Least size of interest, in shares of the typical one."""
        return smallest(self.kind)

    def effect(self) -> Effect:
        """Return the effect at these dials, inside its ranges."""
        values = {p.name: v for p, v in zip(wholes(self.kind), self.whole, strict=True)}
        for p in sizes(self.kind):
            values[p.name] = _inside(p, _sized(p, self.size))
        for p, y in zip(shapes(self.kind), self.dials[1:], strict=True):
            values[p.name] = _inside(p, _shaped(p, getattr(self.pattern, p.name), y))
        return replace(self.pattern, **values)

    def moved(self, step: Floats) -> Self:
        """Return it with its dials turned; a size does not pass through nothing."""
        dials = np.array(self.dials) + step
        if self.read_off and abs(step[0]) < 0.5 * abs(self.nudges[0]):
            dials[0] = self.size
        if dials[0] * self.size <= 0.0:
            dials[0] = 0.2 * self.size
        if self._kept:
            dials[0] = np.clip(dials[0], *reach(self.kind))
        dials[1:] = np.clip(dials[1:], -4.0, 4.0)
        return replace(self, dials=tuple(float(d) for d in dials))

    def resized(self, size: float) -> "Candidate":
        """Return it at another share of its typical size."""
        if self.read_off:
            return self
        if self._kept:
            size = float(np.clip(size, *reach(self.kind)))
        return replace(self, dials=(size, *self.dials[1:]))


def read_off(candidate: Candidate, value: float) -> Candidate:
    """Return the candidate with its size as recordings show it, in its parameter's unit."""
    size = _as_size(sizes(candidate.kind)[0], value)
    return replace(candidate.resized(size), read_off=True)


def sizes(kind: type[Effect]) -> list[Parameter]:
    """Parameters that size the effect."""
    return [p for p in kind.parameters() if p.sized]


def reach(kind: type[Effect]) -> tuple[float, float]:
    """Return the sizes, in shares of the typical one, between which its parameters mean anything.

    An effect of several sizes ends where the first of them does.
    """
    ends = [sorted(_as_size(p, end) for end in (p.low, p.high)) for p in sizes(kind)]
    return max(low for low, _ in ends), min(high for _, high in ends)


def _as_size(p: Parameter, value: float) -> float:
    if math.isinf(p.absent):
        return p.typical / value if value > 0.0 else math.inf
    return (value - p.absent) / (p.typical - p.absent)


def shapes(kind: type[Effect]) -> list[Parameter]:
    """Parameters that shape it."""
    return [p for p in kind.parameters() if not p.sized and not p.whole]


def wholes(kind: type[Effect]) -> list[Parameter]:
    """Parameters that are whole numbers."""
    return [p for p in kind.parameters() if not p.sized and p.whole]


def smallest(kind: type[Effect]) -> float:
    """Least size of interest of an effect, in shares of its typical size."""
    p = sizes(kind)[0]
    least = p.typical if p.smallest is None else p.smallest
    if math.isinf(p.absent):
        return p.typical / least
    return (least - p.absent) / (p.typical - p.absent)


def tried_sizes(kind: type[Effect]) -> tuple[float, ...]:
    """Sizes at which an effect is tried, smallest first.

    A limit does nothing until it is reached and then very much, so it is tried in smaller steps.
    """
    between = STEPS if limits(kind) else ()
    return (smallest(kind), 1.0, *between, LARGE)


def limits(kind: type[Effect]) -> bool:
    """Tell whether an effect limits: absent at infinity."""
    return math.isinf(sizes(kind)[0].absent)


def candidates(kind: type[Effect], places: int = 16) -> Iterator[Candidate]:
    """Yield an effect at its typical size and shape, on every subject.

    places: how many values of a whole parameter mean something (teeth of a disc).
    """
    count = len(shapes(kind))
    for pattern in (p for c in kind.candidates() for p in _sought(c)):
        for whole in _whole_values(kind, places):
            yield Candidate(pattern, (1.0, *([0.0] * count)), whole)


def otherwise(candidate: Candidate, backwards: bool) -> Iterator[Candidate]:
    """Yield the candidate at the other sizes that are tried; backwards: with the other sign."""
    sign = -1.0 if backwards and _both_ways(candidate.kind) else 1.0
    for size in tried_sizes(candidate.kind):
        if sign * size != candidate.size:
            yield candidate.resized(sign * size)


def half_a_turn_on(candidate: Candidate) -> Iterator[Candidate]:
    """Yield the candidate with each angle that goes all round turned by nearly half, either way.

    What cannot be less than nothing shows its opposite there.
    """
    for i, p in enumerate(shapes(candidate.kind), start=1):
        if p.unit == "rad" and math.isclose(p.high - p.low, 2.0 * math.pi, rel_tol=1e-3):
            for y in (-NEARLY_HALF, NEARLY_HALF):
                yield replace(candidate, dials=(*candidate.dials[:i], y, *candidate.dials[i + 1 :]))


def larger(candidate: Candidate) -> Iterator[Candidate]:
    """Yield the candidate at the tried sizes beyond the typical one."""
    for size in tried_sizes(candidate.kind):
        if size > 1.0:
            yield candidate.resized(size)


def reshaped(candidate: Candidate) -> Iterator[Candidate]:
    """Yield the candidate with each shaping parameter at other places of its range."""
    for i in range(1, len(candidate.dials)):
        for y in (-2.0, -1.0, 1.0, 2.0):
            yield replace(candidate, dials=(*candidate.dials[:i], y, *candidate.dials[i + 1 :]))


def place_on_the_road(pattern: Effect) -> float | None:
    """Return where an effect is looked for, in steps of the search; None: nowhere in particular."""
    for p in pattern.parameters():
        if p.sought is not None:
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


def _whole_values(kind: type[Effect], places: int) -> list[tuple[float, ...]]:
    values: list[tuple[float, ...]] = [()]
    for p in wholes(kind):
        values = [(*v, n) for v in values for n in _meant(kind, p, places)]
    return values


def _meant(kind: type[Effect], p: Parameter, places: int) -> list[float]:
    """Values of a whole parameter: every tooth or order; a few about a typical count; one seed."""
    if hasattr(kind, "tooth_offsets"):
        # Teeth count from 0; of orders, from 1, those beyond half the teeth look like lower ones.
        most = places if p.low < 1.0 else places // 2
        return [p.low + i for i in range(min(most, MOST_WHOLE))]
    if p.high > MOST_WHOLE**2:
        return [p.typical]
    near = (p.typical + i for i in range(-ABOUT, ABOUT + 1))
    return [n for n in near if p.low <= n <= p.high]


def _both_ways(kind: type[Effect]) -> bool:
    return any(p.low < p.absent < p.high and not math.isinf(p.absent) for p in sizes(kind))


def _sized(p: Parameter, size: float) -> float:
    if math.isinf(p.absent):
        return p.typical / max(size, 1e-6)
    return p.absent + size * (p.typical - p.absent)


def _shaped(p: Parameter, at: float, y: float) -> float:
    """Return a shape y prior deviations from where it is looked for."""
    if p.sought is not None:
        return at + y * p.sought[2]
    if by_factors(p, at):
        return at * math.exp(SHAPE * y)
    return at + y * (p.high - p.low) / 8.0


def by_factors(p: Parameter, at: float) -> bool:
    """Tell whether a shape is turned by factors, so that a share of it means something."""
    return p.sought is None and at > 0.0 and p.low >= 0.0


def _inside(p: Parameter, value: float) -> float:
    return float(min(max(value, p.low), p.high))
