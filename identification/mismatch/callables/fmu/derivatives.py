"""Effects on the derivatives of an FMU for model exchange, in its units, at the stages of a step."""

import numpy as np

from slipbench.identification.mismatch.callables.acting_rates import ActingRates, Moment, RateLoop
from slipbench.identification.mismatch.callables.fmu.plan import Plan
from slipbench.identification.mismatch.systems.kernel_parts import WITHIN
from slipbench.plant.signals import Floats

STAGES = ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0))
"""Share of the step at which each stage is evaluated, and its weight."""


class Derivatives:
    """What acts on the derivatives in one run: of `begin`, four times `acted`, `end` for each step."""

    def __init__(self, plan: Plan, acting: ActingRates, step: float) -> None:
        """step: of integration, s."""
        self._step, self._loop = step, RateLoop(acting, step)
        self._places = np.array([state.index for state in plan.states], np.int64)
        ports = [state.port for state in plan.states]
        self._slope, self._offset = (
            np.array([getattr(port, key) for port in ports]) for key in ("slope", "offset")
        )
        self._input_slope, self._input_offset = (
            np.array([getattr(port, key) for port in plan.inputs]) for key in ("slope", "offset")
        )
        self._row, self._count, self._row_begins = 0, 0, True
        self._total = self._last = np.zeros_like(self._loop.x)

    def begin(self, row: int, part: int, count: int) -> None:
        """Begin a step. row: of the inputs; part: of the row; count: of the step from the start."""
        self._row, self._count, self._row_begins = row, count, part == 0
        self._total = np.zeros_like(self._loop.x)

    def acted(self, slopes: Floats, x: Floats, inputs: Floats, number: int) -> Floats:
        """Return all derivatives with what acts on them. slopes, x: (states of the FMU,).

        inputs: (inputs,); number: of the stage, from 0. All in units of the FMU.
        """
        share, weight = STAGES[number]
        own = self._loop.x + (share * self._step * self._last if number else 0.0)
        at = Moment.stage(self._count, share, self._step, number == 0, self._row_begins)
        found, self._last = self._act(slopes, x, inputs, own, at)
        self._total = self._total + weight * self._last
        return found

    def once(self, slopes: Floats, x: Floats, inputs: Floats, share: float) -> Floats:
        """Return all derivatives with what acts on them, within a step that is repeated in part.

        share: of the step that has passed. Memories and the effects' own states stay.
        """
        at = Moment(self._count, share, WITHIN, share * self._step)
        return self._act(slopes, x, inputs, self._loop.x, at)[0]

    def end_row(self, slopes: Floats, x: Floats, inputs: Floats) -> None:
        """End a row before its held inputs jump: memories are brought up to date."""
        self._act(slopes, x, inputs, self._loop.x, Moment.row_end(self._count, self._step))

    def _act(
        self, slopes: Floats, x: Floats, inputs: Floats, own: Floats, at: Moment
    ) -> tuple[Floats, Floats]:
        rates, last = self._loop.act(
            slopes[self._places] / self._slope,
            (x[self._places] - self._offset) / self._slope,
            (inputs - self._input_offset) / self._input_slope,
            own,
            self._row,
            at,
        )
        found = slopes.copy()
        found[self._places] = rates * self._slope
        return found, last

    def end(self) -> None:
        """End the step: move the effects' own states."""
        self._loop.x += self._step / 6.0 * self._total
