"""Internal model control: the model runs beside the motorcycle, and only what differs is fed back.

    u = Q (r - (y - G u))

G model with its delay, Q = F / G_- a filter over the part of the model that can be inverted. The
closed loop is T = F e^(-s tau) G_+ where the model is right: its bandwidth is the filter's, the one
number to choose, and it stays stable for every motorcycle of the set where |W T| < 1 (Morari and
Zafiriou, Robust Process Control, 1989, chapter 4). Since the model is driven by the command after
its limits, saturation winds nothing up. Q(0) G(0) = 1 makes the error vanish in the steady state.

Q cancels a resonance by an impulse and a later impulse of opposite sign. Where a limit cut off the
first, the second would do harm: as long as the command stands at a limit and the error asks for
more than that even at rest, Q stands as if the error had been there for ever.
"""

import math
from dataclasses import dataclass

import numpy as np

from slipbench.controllers.limits import Range
from slipbench.controllers.linear import Floats, Linear


@dataclass(frozen=True, eq=False, slots=True)
class ModelState:
    """model, inverse: states of G and Q; late: commands on their way, newest first; command: last;
    base: command and measurement at the start, about which all is linear."""

    model: Floats
    inverse: Floats
    late: Floats
    command: float
    base: tuple[float, float]


@dataclass(frozen=True, eq=False)
class InternalModel:
    """model: G without its delay, strictly proper; inverse: Q; delay: whole steps; period: s."""

    model: Linear
    inverse: Linear
    delay: int
    period: float
    limits: Range

    def __post_init__(self) -> None:
        """Raise ValueError where the model responds to a command without any delay."""
        if self.model.D != 0.0:
            raise ValueError("the model must be strictly proper: a command acts after its period")

    def start(self, command: float, reference: float, measurement: float) -> ModelState:
        """Take over at `command` without a jump: the motorcycle is taken to be at rest there.

        The direct response of the inverse to the first error is held back by its state, the
        smallest one that does, and comes as that state dies away.
        """
        known = measurement if math.isfinite(measurement) else reference
        q, error = self.inverse, reference - known
        held = -q.C * (q.D * error) / max(float(q.C @ q.C), 1e-300)
        late = np.zeros(self.delay + 1)
        return ModelState(np.zeros(self.model.B.size), held, late, command, (command, known))

    def update(
        self, state: ModelState, reference: float, measurement: float, dt: float
    ) -> tuple[float, ModelState]:
        """The command for the next `dt` seconds; a longer step is run as several.

        While the measurement is unknown the command is held, and the model goes on.
        """
        for _ in range(max(round(dt / self.period), 1)):
            state = self._step(state, reference, measurement)
        return state.command, state

    def given(self, state: ModelState, command: float, dt: float) -> ModelState:
        """Drive the model by the part of the last command that the actuators gave."""
        late = state.late.copy()
        late[0] = command - state.base[0]
        return ModelState(state.model, state.inverse, late, state.command, state.base)

    def _expected(self, state: ModelState) -> float:
        return float(self.model.C @ state.model)

    def _step(self, state: ModelState, reference: float, measurement: float) -> ModelState:
        command, level = state.base
        q, inverse, given = self.inverse, state.inverse, state.command
        if math.isfinite(measurement):
            surprise = measurement - level - self._expected(state)
            error = reference - level - surprise
            requested = command + float(q.C @ inverse) + q.D * error
            given = self.limits.towards(requested, state.command, self.period)
            idle = self.limits.withstands(command + q.gain * error - given, given)
            inverse = q.rest(error) if idle else q.A @ inverse + q.B * error
        late = np.concatenate(([given - command], state.late[:-1]))
        model = self.model.A @ state.model + self.model.B * late[-1]
        return ModelState(model, inverse, late, given, state.base)
