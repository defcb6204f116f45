"""The effects around an FMU, grouped by side: inputs, derivatives or outputs."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from slipbench.identification.mismatch.callables.fmu.fmu_system import OpenFmu
from slipbench.identification.mismatch.callables.operators import (
    at_kind,
    input_signals,
    output_signals,
    parts_of_row,
    rate_signals,
)
from slipbench.identification.mismatch.systems.effects.library import CODES
from slipbench.identification.mismatch.systems.effects.seam_effect import (
    INPUT,
    OUTPUT,
    RATE,
    SeamEffect,
)
from slipbench.identification.mismatch.systems.equations import Equations
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.identification.mismatch.systems.run import Integers, slots
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

NONE = -1
MOMENTS = np.array([0.0, 1e3])  # s


@dataclass(frozen=True, eq=False)
class Side:
    """Effects of one side, in the order of the kernel.

    code, where, other: (effects,), par: (effects, 4), SI. parts: substeps per communication step.
    """

    effects: tuple[SeamEffect, ...]
    code: Integers
    where: Integers
    other: Integers
    par: Floats
    parts: int

    @classmethod
    def of(
        cls, kind: str, effects: Sequence[Effect], signals: tuple[Equations, ModelFile]
    ) -> "Side":
        """Return the effects at one kind of injection point. signals: the signals that they use."""
        acting = [e for e in at_kind(kind, effects) if e.act is not None]
        acting.sort(key=lambda e: CODES[e.name])
        equations, file = signals
        return cls(tuple(acting), *slots(acting, [], equations, file), parts_of_row(acting))

    @property
    def delays(self) -> list[int]:
        """Index of the delay parameter of each effect; -1 where it has none."""
        found = [(e.delay_parameter, [p.name for p in e.parameters()]) for e in self.effects]
        return [names.index(delay) if delay else NONE for delay, names in found]


@dataclass(frozen=True, eq=False)
class Sides:
    """All effects around an FMU.

    late: effects that only delay an output, by output. left_out: effects that a simulation in time
    cannot represent, for example a clock that is ahead.
    """

    opened: OpenFmu
    inputs: Side = field(init=False)
    rates: Side = field(init=False)
    outputs: Side = field(init=False)
    late: dict[str, SeamEffect] = field(init=False)
    left_out: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        file, effects = self.opened.model, self.opened.system.acting
        rates = (rate_signals(file), file)
        sides = {
            "inputs": Side.of(INPUT, effects, input_signals(file)),
            "rates": Side.of(RATE, effects, rates),
            "outputs": Side.of(OUTPUT, effects, output_signals(file)),
        }
        late = dict(_late(effects))
        included = {id(e) for side in sides.values() for e in side.effects}
        included |= {id(e) for e in late.values()}
        left_out = tuple(e.key for e in effects if id(e) not in included)
        for name, value in {**sides, "late": late, "left_out": left_out}.items():
            object.__setattr__(self, name, value)

    @property
    def acting(self) -> tuple[SeamEffect, ...]:
        """All effects of the wrapper."""
        sides = (self.inputs, self.rates, self.outputs)
        return (*(e for side in sides for e in side.effects), *self.late.values())


def _late(effects: Sequence[Effect]) -> Iterator[tuple[str, SeamEffect]]:
    """Yield the first effect at each output that is a constant delay."""
    delayed = set()
    for effect in at_kind(OUTPUT, effects):
        name, late = effect.place.name, effect.late(MOMENTS)
        if late is not None and name not in delayed and late[0] >= 0.0 and np.ptp(late) == 0.0:
            delayed.add(name)
            yield name, effect
