"""An effect of the library as something that can be turned up from nothing, and fitted.

Whole numbers are tried one after the other, and so is every channel or wheel that may have the
effect: what a candidate has of them stays as it is.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.sizing import (
    as_size,
    inside,
    integer_parameters,
    reach,
    shape_range,
    shaped,
    shapes,
    sized,
    sizes,
    smallest,
)
from slipbench.identification.mismatch.fit.variance_inflation import VarianceInflation
from slipbench.identification.mismatch.simulation.coordinates import STATED_SHARE
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

DIFFERENCE_STEP = 0.05  # of a size, or of a shape's prior deviation
WEAK = 1e3  # prior deviation of a size, in typical sizes: none to speak of
FAR = 4.0  # prior deviations that no shape goes beyond
ABSENT = (0.0, 0.0)
SHARE_OF_SMALL = 0.1
"""Effects below this share of the smallest size of interest do not count."""
OF_DISCS = 0.5
"""The same for toothed discs, which are all cut with some tolerance."""


@dataclass(frozen=True)
class Candidate(Hypothesis):
    """An effect with the values of its dials: first the size, then what shapes it.

    pattern: the effect on its subject, at its typical size, where it is looked for. dials: size in
    typical sizes, shapes as unit normals. integers: values of whole parameters. placebo: how its
    size scatters over other places at which it is looked for, if it has any. fixed_from_data: its size is
    read off the recordings, and no fit of what is left tells it better. stated: size at which the
    file has the effect already, and how far it may be off there (95 %), both in typical sizes.
    """

    pattern: Effect
    parameters: tuple[float, ...]
    integers: tuple[float, ...] = ()
    placebo: VarianceInflation | None = None
    fixed_from_data: bool = False
    stated: tuple[float, float] = ABSENT

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
        return (WEAK, *([1.0] * (len(self.parameters) - 1)))

    @property
    def difference_steps(self) -> tuple[float, ...]:
        """In proportion to the size; backwards where a parameter is at the end of its range."""
        steps = (DIFFERENCE_STEP * self.size, *([DIFFERENCE_STEP] * (len(self.parameters) - 1)))
        return tuple(-s if self._ends_within(i, s) else s for i, s in enumerate(steps))

    def _ends_within(self, parameter: int, step: float) -> bool:
        """Tell whether the range of a dial ends before a step is done."""
        there = self.moved(step * np.eye(len(self.parameters))[parameter])
        short = abs(there.parameters[parameter] - self.parameters[parameter]) < 0.999 * abs(step)
        return short or there.effect() == self.effect()

    @property
    def negligible_size(self) -> float:
        """Size below which it does not count, in shares of the typical one."""
        share = OF_DISCS if hasattr(self.kind, "tooth_offsets") else SHARE_OF_SMALL
        return share * self.smallest

    @property
    def negligible_difference(self) -> float:
        """How far its size may be from what the file states and mean nothing, in typical sizes."""
        return max(self.negligible_size, self.stated[1])

    @property
    def added(self) -> float:
        """How far its size is from what the file states, in typical sizes."""
        return self.size - self.stated[0]

    @property
    def size(self) -> float:
        """Share of the typical size."""
        return self.parameters[0]

    @property
    def smallest(self) -> float:
        """Least size of interest, in shares of the typical one."""
        return smallest(self.kind)

    def effect(self) -> Effect:
        """Return the effect at these dials, inside its ranges."""
        values = {
            p.name: v for p, v in zip(integer_parameters(self.kind), self.integers, strict=True)
        }
        for p in sizes(self.kind):
            values[p.name] = inside(p, sized(p, self.size))
        for p, y in zip(shapes(self.kind), self.parameters[1:], strict=True):
            values[p.name] = inside(p, shaped(p, getattr(self.pattern, p.name), y))
        return replace(self.pattern, **values)

    def moved(self, step: Floats) -> Self:
        """Return it with its dials turned; a size does not pass through nothing."""
        parameters = np.array(self.parameters) + step
        if self.fixed_from_data and abs(step[0]) < 0.5 * DIFFERENCE_STEP * abs(self.size):
            parameters[0] = self.size
        if parameters[0] * self.size <= 0.0:
            parameters[0] = 0.2 * self.size
        return replace(self, parameters=tuple(float(d) for d in parameters)).within()

    def within(self) -> Self:
        """Return it with its dials where its parameters mean something."""
        ends = [reach(self.kind)]
        for p in shapes(self.kind):
            low, high = shape_range(p, getattr(self.pattern, p.name))
            ends.append((max(low, -FAR), min(high, FAR)))
        parameters = (float(np.clip(d, *end)) for d, end in zip(self.parameters, ends, strict=True))
        return replace(self, parameters=tuple(parameters))

    def resized(self, size: float) -> "Candidate":
        """Return it at another share of its typical size."""
        if self.fixed_from_data:
            return self
        return replace(self, parameters=(size, *self.parameters[1:])).within()

    def amplified(self, amplitude: float) -> "Candidate":
        """Return it with that many times of what it adds to the file."""
        return self.resized(self.stated[0] + amplitude * self.added)


def beside_the_file(candidate: Candidate, system: System) -> Candidate:
    """Return the candidate with the size at which the file has the effect, if it has it."""
    own = next((e for e in system.effects if e.key == candidate.name), None)
    if own is None:
        return candidate
    p = sizes(candidate.kind)[0]
    value = float(getattr(own, p.name))
    half = system.plus_minus.get(f"effects.{own.key}.{p.name}", STATED_SHARE * abs(value))
    size = as_size(p, value)
    return replace(candidate, stated=(size, abs(as_size(p, value + half) - size)))


def fixed_from_data(candidate: Candidate, value: float) -> Candidate:
    """Return the candidate with its size as recordings show it, in its parameter's unit."""
    size = as_size(sizes(candidate.kind)[0], value)
    return replace(candidate.resized(size), fixed_from_data=True)
