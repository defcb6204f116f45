"""An effect of the library as something that can be turned up from nothing, and fitted.

Whole numbers are tried one after the other, and so is every channel or wheel that may have the
effect: what a candidate has of them stays as it is.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from identification.mismatch.fit.dialled import Dialled
from identification.mismatch.fit.scatter import Scatter
from identification.mismatch.fit.sizing import (
    as_size,
    inside,
    reach,
    shaped,
    shapes,
    sized,
    sizes,
    smallest,
    wholes,
)
from plant.effects.effect import Effect
from plant.signals import Floats

NUDGE = 0.05  # of a size, or of a shape's prior deviation
WEAK = 1e3  # prior deviation of a size, in typical sizes: none to speak of
SHARE_OF_SMALL = 0.1
"""Effects below this share of the smallest size of interest do not count."""
OF_DISCS = 0.5
"""The same for toothed discs, which are all cut with some tolerance."""


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
            values[p.name] = inside(p, sized(p, self.size))
        for p, y in zip(shapes(self.kind), self.dials[1:], strict=True):
            values[p.name] = inside(p, shaped(p, getattr(self.pattern, p.name), y))
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
    size = as_size(sizes(candidate.kind)[0], value)
    return replace(candidate.resized(size), read_off=True)
