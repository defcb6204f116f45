"""Effects on the derivatives of an FMU for model exchange, in its units, at Runge-Kutta stages."""

import numpy as np

from slipbench.identification.mismatch.callables.acting_rates import ActingRates, Moment, RateLoop
from slipbench.identification.mismatch.callables.fmu.plan import Plan
from slipbench.identification.mismatch.systems.kernel_parts import WITHIN
from slipbench.plant.signals import Floats

STAGES = ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0))
"""Stages of the classical Runge-Kutta rule: fraction of the step, and weight."""


class Derivatives:
    """Disturbances and effects on the derivatives in one run.

    Call order for each step: `begin`, four times `acted`, `end`.
    """

    def __init__(self, plan: Plan, acting: ActingRates, step: float) -> None:
        """step: integration step, s."""
        self._step, self._loop = step, RateLoop(acting, step)
        self._state_indices = np.array([state.index for state in plan.states], np.int64)
        ports = [state.port for state in plan.states]
        self._slope, self._offset = (
            np.array([getattr(port, key) for port in ports]) for key in ("slope", "offset")
        )
        self._input_slope, self._input_offset = (
            np.array([getattr(port, key) for port in plan.inputs]) for key in ("slope", "offset")
        )
        self._row, self._count, self._row_begins = 0, 0, True
        self._weighted_rates = self._effect_rates = np.zeros_like(self._loop.x)

    def begin(self, row: int, part: int, count: int) -> None:
        """Begin a step. row: index of the row; part: substep of the row; count: step of the run."""
        self._row, self._count, self._row_begins = row, count, part == 0
        self._weighted_rates = np.zeros_like(self._loop.x)

    def acted(self, slopes: Floats, x: Floats, inputs: Floats, number: int) -> Floats:
        """Return all derivatives with disturbances and effects, at one stage of a step.

        slopes, x: (states of the FMU,); inputs: (inputs,); number: index of the stage, from 0. All
        in units of the FMU.
        """
        share, weight = STAGES[number]
        effect_states = self._loop.x + (share * self._step * self._effect_rates if number else 0.0)
        at = Moment.stage(self._count, share, self._step, number == 0, self._row_begins)
        derivatives, self._effect_rates = self._act(slopes, x, inputs, effect_states, at)
        self._weighted_rates = self._weighted_rates + weight * self._effect_rates
        return derivatives

    def once(self, slopes: Floats, x: Floats, inputs: Floats, share: float) -> Floats:
        """Return all derivatives with disturbances and effects, in a repeated part of a step.

        slopes, x: shape (states of the FMU,); inputs: shape (inputs,); all in units of the FMU.
        share: elapsed fraction of the step. Memories and states of the effects do not change.
        """
        at = Moment(self._count, share, WITHIN, share * self._step)
        return self._act(slopes, x, inputs, self._loop.x, at)[0]

    def end_row(self, slopes: Floats, x: Floats, inputs: Floats) -> None:
        """End a row before the held inputs change: update the memories of the effects.

        slopes, x: shape (states of the FMU,); inputs: shape (inputs,); all in units of the FMU.
        """
        self._act(slopes, x, inputs, self._loop.x, Moment.row_end(self._count, self._step))

    def _act(
        self, slopes: Floats, x: Floats, inputs: Floats, effect_states: Floats, at: Moment
    ) -> tuple[Floats, Floats]:
        rates, effect_rates = self._loop.act(
            slopes[self._state_indices] / self._slope,
            (x[self._state_indices] - self._offset) / self._slope,
            (inputs - self._input_offset) / self._input_slope,
            effect_states,
            self._row,
            at,
        )
        derivatives = slopes.copy()
        derivatives[self._state_indices] = rates * self._slope
        return derivatives, effect_rates

    def end(self) -> None:
        """End the step: integrate the states of the effects."""
        self._loop.x += self._step / 6.0 * self._weighted_rates
