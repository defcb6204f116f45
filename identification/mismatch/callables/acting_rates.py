"""What acts on the rates of a simulation's states: added signals and effects, step by step.

The effects are those of the compiled kernel of model files (systems/kernel.py): its function `at` is
called at each stage of integration, so their memories and states mean the same here.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.systems.kernel import (
    MOST_MEMORIES,
    MOST_STATES,
    effects_module,
)
from slipbench.identification.mismatch.systems.run import Integers
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class ActingRates:
    """What acts in one run, SI.

    states: names. push: (rows, states), added to the rates. held: of each input, 1 where it holds.
    code, where, other: (effects,), par: (effects, 4), as the kernel takes them. longest: delay, s.
    """

    states: tuple[str, ...]
    push: Floats
    held: Floats
    code: Integers
    where: Integers
    other: Integers
    par: Floats
    longest: float

    @property
    def arrays(self) -> tuple[Floats | Integers, ...]:
        """All that distinguishes one run from another."""
        return (self.push, self.code, self.where, self.other, self.par)


class RateLoop:
    """The effects of one run, with their states and memories. `x`: (effect states,), at the step."""

    def __init__(self, acting: ActingRates, step: float) -> None:
        """step: of integration, s."""
        effects = len(acting.code)
        ring = 1 << (int(acting.longest / step) + 3).bit_length()
        self._acting, self._step = acting, step
        self._at = effects_module().at
        self._memory = np.zeros((effects, MOST_MEMORIES))
        self._rings = np.zeros((effects, ring))
        self._spill = np.zeros(len(acting.states))
        self._q = np.zeros(len(acting.held) + len(acting.states))
        self._x = np.zeros(len(acting.states) + MOST_STATES * effects)
        self._dx = np.zeros_like(self._x)
        first = len(acting.held)
        self._busy = [(k, first + k, first + k in acting.where) for k in range(len(acting.states))]
        self.x = np.zeros(MOST_STATES * effects)

    def act(
        self, rates: Floats, states: Floats, inputs: Floats, own: Floats, row: int, at: "Moment"
    ) -> tuple[Floats, Floats]:
        """Return the rates with what acts on them, and the rates of the effects' states.

        rates, states: (states,); inputs: (inputs,); own: the effects' states, (effect states,).
        """
        size = len(states)
        self._q[: len(inputs)], self._q[len(inputs) :] = inputs, states
        self._x[:size], self._x[size:] = states, own
        self._spill[:] = self._dx[:] = 0.0
        found = rates + self._acting.push[row]
        for k, place, busy in self._busy:
            if busy:
                found[k] = self._act_at(place, found[k], states[k], at)
        if at.init:
            self.x[:] = self._x[size:]
        return found + self._spill, self._dx[size:].copy()

    def _act_at(self, place: int, value: float, own: float, at: "Moment") -> float:
        a = self._acting
        acted: float = self._at(
            place,
            value,
            own,
            at.fraction,
            at.commit,
            at.init,
            self._x,
            self._dx,
            a.code,
            a.where,
            a.other,
            a.par,
            self._q,
            self._spill,
            self._memory,
            self._rings,
            at.count,
            self._step,
            a.held,
        )
        return acted


@dataclass(frozen=True)
class Moment:
    """A stage of integration. count: of the step; fraction: of the step that has passed.

    commit: whether it is the step's beginning, where memories are renewed.
    """

    count: int
    fraction: float
    commit: bool

    @property
    def init(self) -> bool:
        """Whether it is the very first."""
        return self.commit and self.count == 0
