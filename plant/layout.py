"""Index of every parameter and state in the kernel's arrays, for one set of effects."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np

from slipbench.plant.effects.effect import Effect
from slipbench.plant.equations import RATES
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import Floats

EffectClass = type[Effect]


def moving(effects: Iterable[EffectClass]) -> tuple[EffectClass, ...]:
    """Effects that act in the equations of motion, each once; the others act in a sensor."""
    return tuple(dict.fromkeys(effect for effect in effects if effect.hooks))


@dataclass(frozen=True)
class Layout:
    """Names in the kernel's order.

    parameters: of the blocks, then of each effect with its switch, then the switches of the seams.
    """

    effects: tuple[EffectClass, ...]
    parameters: tuple[str, ...]
    states: tuple[str, ...]

    @property
    def effect_states(self) -> tuple[str, ...]:
        """Names of the states that effects add, as '<effect>.<state>'."""
        return self.states[len(RATES) :]

    def pack(self, motorcycle: Motorcycle) -> Floats:
        """The motorcycle's parameters in SI in the kernel's order, shape (parameters,).

        Absent effects have the values at which they do nothing.
        """
        packed = self._absent.copy()
        values = [value for _, block in motorcycle.blocks() for value in block.values()]
        packed[: len(values)] = values
        for effect in motorcycle.effects:
            for hook in effect.hooks:
                packed[self._places[f"acting.{hook.seam}"]] = 1.0
            if effect.hooks:
                first = self._places[f"{effect.name}.present"]
                here = (1.0, *effect.values())
                packed[first : first + len(here)] = here
        return packed

    @cached_property
    def _places(self) -> dict[str, int]:
        """Place of each parameter."""
        return {name: i for i, name in enumerate(self.parameters)}

    @cached_property
    def _absent(self) -> Floats:
        """Parameters of a motorcycle without effects, those of its blocks left open as NaN."""
        new = np.full(len(self.parameters), np.nan)
        for effect in self.effects:
            first = self._places[f"{effect.name}.present"]
            off = (0.0, *(p.absent for p in effect.parameters()))
            new[first : first + len(off)] = off
        for seam in seams(self.effects):
            new[self._places[f"acting.{seam}"]] = 0.0
        return new


@cache
def layout(effects: tuple[EffectClass, ...]) -> Layout:
    """The layout of the kernel for these effects."""
    parameters = [
        f"{name}_{p.name}" for name, block in Motorcycle().blocks() for p in block.parameters()
    ]
    for effect in effects:
        parameters.append(f"{effect.name}.present")
        parameters.extend(f"{effect.name}.{p.name}" for p in effect.parameters())
    parameters.extend(f"acting.{seam}" for seam in seams(effects))
    states = [*RATES, *(f"{e.name}.{s}" for e in effects for s in e.states)]
    return Layout(effects, tuple(parameters), tuple(states))


@cache
def seams(effects: tuple[EffectClass, ...]) -> tuple[str, ...]:
    """The seams at which any of these effects acts."""
    return tuple(sorted({hook.seam for effect in effects for hook in effect.hooks}))
