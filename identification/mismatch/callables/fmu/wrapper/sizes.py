"""Parameters of the effects as variables of the FMU, SI."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from slipbench.identification.mismatch.callables.fmu.wrapper.sides import Side, Sides
from slipbench.identification.mismatch.systems.board import PARAMETERS_OF_ONE
from slipbench.identification.mismatch.systems.effects.seam_effect import SeamEffect
from slipbench.plant.parameters import Parameter

INPUT_SIDE, RATE_SIDE, OUTPUT_SIDE, LATE_SIDE = (
    "INPUT_SIDE",
    "RATE_SIDE",
    "OUTPUT_SIDE",
    "LATE_SIDE",
)


@dataclass(frozen=True)
class EffectSize:
    """A parameter of an effect. side, index: its position in the tables of the wrapper.

    known: its unit, meaning and range. value: SI.
    """

    name: str
    side: str
    index: int
    known: Parameter
    value: float

    @property
    def bounds(self) -> tuple[float, float]:
        """Lower and upper bound; the lower bound of a delay is at least 0."""
        low = max(self.known.low, 0.0) if self.side == LATE_SIDE else self.known.low
        return (
            (low, self.known.high)
            if low <= self.value <= self.known.high
            else (-math.inf, math.inf)
        )


def effect_sizes(sides: Sides) -> list[EffectSize]:
    """Return the parameters of all effects, in the order of their variables."""
    outputs = list(sides.opened.model.outputs)
    found = [
        *_of_side(INPUT_SIDE, sides.inputs),
        *_of_side(RATE_SIDE, sides.rates),
        *_of_side(OUTPUT_SIDE, sides.outputs),
    ]
    for name, effect in sides.late.items():
        (known,) = effect.parameters()
        (value,) = effect.values()
        found.append(_size(effect, LATE_SIDE, outputs.index(name), known, value))
    return found


def _of_side(name: str, side: Side) -> Iterator[EffectSize]:
    for number, effect in enumerate(side.effects):
        pairs = zip(effect.parameters(), effect.values(), strict=True)
        for k, (known, value) in enumerate(pairs):
            yield _size(effect, name, PARAMETERS_OF_ONE * number + k, known, value)


def _size(effect: SeamEffect, side: str, index: int, known: Parameter, value: float) -> EffectSize:
    name = f"effects.{effect.name}.{effect.subject.replace('/', '.')}.{known.name}"
    return EffectSize(name, side, index, known, float(value))
