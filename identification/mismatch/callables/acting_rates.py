"""Input disturbances and effects on the state derivatives of a simulation, at each stage of a step.

The effects are those of the compiled kernel of model files (systems/kernel.py). Its function `at`
is called at each stage of integration, so memories and states of effects work as in that kernel.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.systems.board import STATES_OF_ONE, board
from slipbench.identification.mismatch.systems.equations import Equations
from slipbench.identification.mismatch.systems.kernel import effects_module, first_input
from slipbench.identification.mismatch.systems.kernel_parts import END, FIRST, ROW, STEP, WITHIN
from slipbench.identification.mismatch.systems.run import Integers
from slipbench.plant.signals import Floats


@dataclass(frozen=True, eq=False)
class ActingRates:
    """Disturbances and effects on the state derivatives in one run, SI.

    equations: of the inputs and states alone. push: input disturbance, (rows, states), added to the
    rates. code, where, other: (effects,), par: (effects, 4), arguments of the kernel. longest:
    longest delay, s.
    """

    equations: Equations
    push: Floats
    code: Integers
    where: Integers
    other: Integers
    par: Floats
    longest: float

    @property
    def arrays(self) -> tuple[Floats | Integers, ...]:
        """Arrays that identify the disturbances and effects of a run.

        push: SI, shape (rows, states); code, where, other: shape (effects,); par: (effects, 4).
        """
        return (self.push, self.code, self.where, self.other, self.par)


class RateLoop:
    """Effects of one run, with their states and memories.

    x: states of the effects at the beginning of the step, (effect states,).
    """

    def __init__(self, acting: ActingRates, step: float) -> None:
        """step: integration step, s."""
        effects = len(acting.code)
        ring = 1 << (int(acting.longest / step) + 3).bit_length()
        states, inputs = len(acting.equations.states), len(acting.equations.inputs)
        self._acting, self._step = acting, step
        self._at = effects_module().at
        self._rings = np.zeros((effects, 2, ring))
        self._tables = np.zeros((effects, 2, 1))
        first, own = first_input(acting.equations), STATES_OF_ONE * effects
        effect_arrays = (acting.code, acting.where, acting.other, acting.par)
        self._board = board(*effect_arrays, states, first + inputs)[0]
        self._spill = self._board["spill"][:states]
        self._q = self._board["q"][first : first + inputs + states]
        self._x, self._dx = self._board["x"][: states + own], self._board["dx"][: states + own]
        self._targets = [(k, inputs + k, inputs + k in acting.where) for k in range(states)]
        self.x = np.zeros(own)

    def act(
        self, rates: Floats, states: Floats, inputs: Floats, own: Floats, row: int, at: "Moment"
    ) -> tuple[Floats, Floats]:
        """Return the rates with disturbance and effects, and the rates of the effect states.

        rates, states: shape (states,), SI; inputs: shape (inputs,), SI; own: states of the effects,
        shape (effect states,). row: index of the row. Both results have the shape of their states.
        """
        size = len(states)
        self._q[:] = np.concatenate((inputs, states))
        self._x[:size], self._x[size:] = states, own
        self._spill[:] = self._dx[:] = 0.0
        total = rates + self._acting.push[row]
        for k, place, has_effect in self._targets:
            if has_effect:
                total[k] = self._act_at(place, total[k], states[k], at)
        if at.when == FIRST:
            self.x[:] = self._x[size:]
        return total + self._spill, self._dx[size:].copy()

    def _act_at(self, place: int, value: float, own: float, at: "Moment") -> float:
        value_after: float = self._at(
            place,
            value,
            own,
            at.fraction,
            at.elapsed,
            at.when,
            self._board,
            self._tables,
            self._rings,
            at.count,
            self._step,
        )
        return value_after


@dataclass(frozen=True)
class Moment:
    """Time at which rates are evaluated.

    count: index of the step; fraction: elapsed part of the step. when: code of the stage in the
    kernel of model files. elapsed: since the last memory update, s.
    """

    count: int
    fraction: float
    when: int
    elapsed: float

    @classmethod
    def stage(cls, count: int, fraction: float, step: float, begins: bool, row: bool) -> "Moment":
        """Return a stage of a step.

        begins: whether it is the first stage of the step. row: whether the step begins a row.
        """
        if not begins:
            return cls(count, fraction, WITHIN, fraction * step)
        if row:
            return cls(count, 0.0, ROW if count else FIRST, 0.0)
        return cls(count, 0.0, STEP, step)

    @classmethod
    def row_end(cls, count: int, step: float) -> "Moment":
        """Return the end of a row, before the next input value. count: index of its last step."""
        return cls(count, 1.0, END, step)
