"""An effect of the library as a hypothesis that can be added from magnitude zero and fitted.

Integer parameters are not fitted: a candidate keeps its values, and one candidate is tested for
each value. The same holds for every channel or wheel that may have the effect.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.sizing import (
    as_size,
    clipped,
    integer_parameters,
    shape_range,
    shaped,
    shapes,
    size_range,
    sized,
    sizes,
    smallest,
)
from slipbench.identification.mismatch.fit.variance_inflation import VarianceInflation
from slipbench.identification.mismatch.simulation.coordinates import STATED_SHARE
from slipbench.identification.mismatch.simulation.system import System
from slipbench.identification.mismatch.thresholds import NEGLIGIBLE_DISC_SHARE, NEGLIGIBLE_SHARE
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

DIFFERENCE_STEP = 0.05  # share of the size; of a shape, in prior deviations
WEAK = 1e3  # prior deviation of a size, in typical sizes: practically flat
FAR = 4.0  # bound of a shape, in prior deviations
ABSENT = (0.0, 0.0)


@dataclass(frozen=True)
class Candidate(Hypothesis):
    """An effect with the values of its parameters: first the size, then the shapes.

    pattern: the effect on its subject, at its typical size and at the location tested. parameters:
    size in typical sizes, shapes as unit normals. integers: values of integer parameters. placebo:
    variance inflation of its size at placebo locations, if it has any. fixed_from_data: its size is
    determined directly from the recordings and is not improved by a fit of the residual. stated:
    size that the file states for the effect, and its 95 % half width, both in typical sizes.
    """

    pattern: Effect
    parameters: tuple[float, ...]
    integers: tuple[float, ...] = ()
    placebo: VarianceInflation | None = None
    fixed_from_data: bool = False
    stated: tuple[float, float] = ABSENT

    @property
    def kind(self) -> type[Effect]:
        """Class of the effect."""
        return type(self.pattern)

    @property
    def name(self) -> str:
        """Name of the effect, with its subject."""
        return self.pattern.key

    @property
    def deviations(self) -> tuple[float, ...]:
        """Prior deviation of each parameter; that of the size is practically flat."""
        return (WEAK, *([1.0] * (len(self.parameters) - 1)))

    @property
    def difference_steps(self) -> tuple[float, ...]:
        """Finite-difference steps; negative at the upper end of a range."""
        steps = (DIFFERENCE_STEP * self.size, *([DIFFERENCE_STEP] * (len(self.parameters) - 1)))
        return tuple(-s if self._range_ends_within(i, s) else s for i, s in enumerate(steps))

    def _range_ends_within(self, parameter: int, step: float) -> bool:
        """Return whether the range of a parameter ends before the step does."""
        stepped = self.moved(step * np.eye(len(self.parameters))[parameter])
        short = abs(stepped.parameters[parameter] - self.parameters[parameter]) < 0.999 * abs(step)
        return short or stepped.effect() == self.effect()

    @property
    def negligible_size(self) -> float:
        """Size below which the effect is negligible, in typical sizes."""
        share = NEGLIGIBLE_DISC_SHARE if hasattr(self.kind, "tooth_offsets") else NEGLIGIBLE_SHARE
        return share * self.smallest

    @property
    def negligible_difference(self) -> float:
        """Negligible difference of its size from the stated one, in typical sizes."""
        return max(self.negligible_size, self.stated[1])

    @property
    def added(self) -> float:
        """Difference of its size from the stated one, in typical sizes."""
        return self.size - self.stated[0]

    @property
    def size(self) -> float:
        """Size in typical sizes."""
        return self.parameters[0]

    @property
    def smallest(self) -> float:
        """Smallest size of interest, in typical sizes."""
        return smallest(self.kind)

    def effect(self) -> Effect:
        """Return the effect at these parameters, clipped to its ranges."""
        values = {
            p.name: v for p, v in zip(integer_parameters(self.kind), self.integers, strict=True)
        }
        for p in sizes(self.kind):
            values[p.name] = clipped(p, sized(p, self.size))
        for p, y in zip(shapes(self.kind), self.parameters[1:], strict=True):
            values[p.name] = clipped(p, shaped(p, getattr(self.pattern, p.name), y))
        return replace(self.pattern, **values)

    def moved(self, step: Floats) -> Self:
        """Return the candidate after a step of its parameters; the size keeps its sign.

        step: shape (parameters,), in typical sizes for the size, in prior deviations for the
        shapes.
        """
        parameters = np.array(self.parameters) + step
        if self.fixed_from_data and abs(step[0]) < 0.5 * DIFFERENCE_STEP * abs(self.size):
            parameters[0] = self.size
        if parameters[0] * self.size <= 0.0:
            parameters[0] = 0.2 * self.size
        return replace(self, parameters=tuple(float(d) for d in parameters)).within()

    def within(self) -> Self:
        """Return the candidate with its parameters clipped to their ranges."""
        bounds = [size_range(self.kind)]
        for p in shapes(self.kind):
            low, high = shape_range(p, getattr(self.pattern, p.name))
            bounds.append((max(low, -FAR), min(high, FAR)))
        parameters = (
            float(np.clip(d, *bound)) for d, bound in zip(self.parameters, bounds, strict=True)
        )
        return replace(self, parameters=tuple(parameters))

    def resized(self, size: float) -> "Candidate":
        """Return the candidate at another size, in typical sizes."""
        if self.fixed_from_data:
            return self
        return replace(self, parameters=(size, *self.parameters[1:])).within()

    def amplified(self, amplitude: float) -> "Candidate":
        """Return the candidate with `amplitude` times its difference from the stated size."""
        return self.resized(self.stated[0] + amplitude * self.added)


def beside_the_file(candidate: Candidate, system: System) -> Candidate:
    """Return the candidate with the size that the file states for the effect, if it states one."""
    stated_effect = next((e for e in system.effects if e.key == candidate.name), None)
    if stated_effect is None:
        return candidate
    p = sizes(candidate.kind)[0]
    value = float(getattr(stated_effect, p.name))
    half_width = system.plus_minus.get(
        f"effects.{stated_effect.key}.{p.name}", STATED_SHARE * abs(value)
    )
    size = as_size(p, value)
    return replace(candidate, stated=(size, abs(as_size(p, value + half_width) - size)))


def fixed_from_data(candidate: Candidate, value: float) -> Candidate:
    """Return the candidate with its size read from data. value: in its parameter's unit."""
    size = as_size(sizes(candidate.kind)[0], value)
    return replace(candidate.resized(size), fixed_from_data=True)
