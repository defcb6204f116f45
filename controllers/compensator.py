"""Any linear controller with an integral, run so that limits wind nothing up.

    u = I + F e,   I' = K_i e + (u_limited - u) / T_t,   e = r - y

F a stable linear system: all of a synthesis but its integrator; K_i integral gain (1/s); T_t
tracking time of the anti-windup, s. F forgets by itself, the integral is tracked by
back-calculation (Astroem and Haegglund, Advanced PID Control, 2006, section 3.5). At the start F
stands as if the error had been there for ever, and the integral has the rest of the command.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from slipbench.controllers.limits import Range
from slipbench.controllers.linear import Floats, Linear


@dataclass(frozen=True, eq=False, slots=True)
class CompensatorState:
    """integral: I; filtered: state of F; command: given last."""

    integral: float
    filtered: Floats
    command: float


@dataclass(frozen=True, eq=False)
class Compensator:
    """integral: K_i; shaping: F at steps of `period` s; see the head of this file."""

    integral: float
    shaping: Linear
    period: float
    limits: Range
    tracking_time: float

    def __post_init__(self) -> None:
        """Raise ValueError where the tracking time is not positive."""
        if not self.tracking_time > 0.0:
            raise ValueError("tracking_time must be above 0 s")

    def start(self, command: float, reference: float, measurement: float) -> CompensatorState:
        """Take over at `command` without a jump."""
        error = reference - measurement if math.isfinite(measurement) else 0.0
        rest = self.shaping.rest(error)
        return CompensatorState(command - self._shaped(rest, error), rest, command)

    def update(
        self, state: CompensatorState, reference: float, measurement: float, dt: float
    ) -> tuple[float, CompensatorState]:
        """The command for the next `dt` seconds; a longer step is run as several."""
        error = reference - measurement
        if not math.isfinite(error):
            return state.command, state
        for _ in range(max(round(dt / self.period), 1)):
            state = self._step(state, error)
        return state.command, state

    def given(self, state: CompensatorState, command: float, dt: float) -> CompensatorState:
        """Track the part of the last command that the actuators gave, as at a limit."""
        back = min(dt / self.tracking_time, 1.0) * (command - state.command)
        return replace(state, integral=state.integral + back)

    def _step(self, state: CompensatorState, error: float) -> CompensatorState:
        F = self.shaping
        requested = state.integral + self._shaped(state.filtered, error)
        command = self.limits.towards(requested, state.command, self.period)
        back = min(self.period / self.tracking_time, 1.0) * (command - requested)
        integral = state.integral + self.integral * error * self.period + back
        return CompensatorState(integral, np.asarray(F.A @ state.filtered + F.B * error), command)

    def _shaped(self, filtered: Floats, error: float) -> float:
        return float(self.shaping.C @ filtered) + self.shaping.D * error
