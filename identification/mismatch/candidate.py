"""An effect of the library as something that can be turned up from nothing, and fitted.

Its size is told in shares of the typical one: 0 absent, 1 typical. Effects that limit (absent at
infinity) grow as their limit falls: size = typical / limit. Parameters that only shape an effect
keep near their typical value; whole numbers are tried one after the other.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from plant.effects.effect import Effect
from plant.parameters import Parameter
from plant.signals import Floats

SIZES = (0.3, 1.0, 3.0)
"""Shares of the typical size at which every effect is tried."""
SMALL = 0.3
"""Smallest size of interest, in shares of the typical one."""
SHAPE = math.log(1.6)
"""Prior deviation of a shaping parameter's logarithm."""
MOST_WHOLE = 48


@dataclass(frozen=True)
class Candidate:
    """An effect with the values of its dials: first the size, then what shapes it.

    dials: size in typical sizes, shapes as unit normals. whole: values of whole parameters.
    """

    kind: type[Effect]
    dials: tuple[float, ...]
    whole: tuple[float, ...] = ()

    @property
    def name(self) -> str:
        """The effect's word."""
        return self.kind.name

    @property
    def size(self) -> float:
        """Share of the typical size."""
        return self.dials[0]

    def effect(self) -> Effect:
        """Return the effect at these dials, inside its ranges."""
        values = {p.name: v for p, v in zip(wholes(self.kind), self.whole, strict=True)}
        for p in sizes(self.kind):
            values[p.name] = _inside(p, _sized(p, self.size))
        for p, y in zip(shapes(self.kind), self.dials[1:], strict=True):
            values[p.name] = _inside(p, _shaped(p, y))
        return self.kind(**values)

    def moved(self, step: Floats) -> "Candidate":
        """Return it with its dials turned; a size does not pass through nothing."""
        dials = np.array(self.dials) + step
        if dials[0] * self.size <= 0.0:
            dials[0] = 0.2 * self.size
        dials[1:] = np.clip(dials[1:], -4.0, 4.0)
        return Candidate(self.kind, tuple(float(d) for d in dials), self.whole)


def sizes(kind: type[Effect]) -> list[Parameter]:
    """Parameters whose absent value makes the effect vanish."""
    return [p for p in kind.parameters() if p.absent != p.typical]


def shapes(kind: type[Effect]) -> list[Parameter]:
    """Parameters that shape it."""
    return [p for p in kind.parameters() if p.absent == p.typical and not p.whole]


def wholes(kind: type[Effect]) -> list[Parameter]:
    """Parameters that are whole numbers."""
    return [p for p in kind.parameters() if p.absent == p.typical and p.whole]


def candidates(kind: type[Effect], places: int = 16) -> Iterator[Candidate]:
    """Yield an effect at its typical shape and every size and sign that its range allows.

    places: how many values of a whole parameter mean something (teeth of a disc).
    """
    count = len(shapes(kind))
    for size in SIZES:
        for sign in (1.0, -1.0):
            if sign > 0 or _both_ways(kind):
                for whole in _whole_values(kind, places):
                    yield Candidate(kind, (sign * size, *([0.0] * count)), whole)


def reshaped(candidate: Candidate) -> Iterator[Candidate]:
    """Yield the candidate with each shaping parameter at other places of its range."""
    for i in range(1, len(candidate.dials)):
        for y in (-2.0, -1.0, 1.0, 2.0):
            dials = (*candidate.dials[:i], y, *candidate.dials[i + 1 :])
            yield Candidate(candidate.kind, dials, candidate.whole)


def _whole_values(kind: type[Effect], places: int) -> list[tuple[float, ...]]:
    values: list[tuple[float, ...]] = [()]
    for p in wholes(kind):
        top = min(p.high, p.low + min(places, MOST_WHOLE) - 1)
        values = [(*v, float(n)) for v in values for n in range(int(p.low), int(top) + 1)]
    return values


def _both_ways(kind: type[Effect]) -> bool:
    return any(p.low < p.absent < p.high and not math.isinf(p.absent) for p in sizes(kind))


def _sized(p: Parameter, size: float) -> float:
    if math.isinf(p.absent):
        return p.typical / max(size, 1e-6)
    return p.absent + size * (p.typical - p.absent)


def _shaped(p: Parameter, y: float) -> float:
    if p.typical > 0.0 and p.low >= 0.0:
        return p.typical * math.exp(SHAPE * y)
    return p.typical + y * (p.high - p.low) / 8.0


def _inside(p: Parameter, value: float) -> float:
    return float(min(max(value, p.low), p.high))
