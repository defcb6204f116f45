"""The PID controller in its textbook form with everything that a real loop needs.

    u = K_p (b r - y) + I + D,   I' = K_i (r - y) + (u_limited - u) / T_t,
    D = -K_d s / (1 + T_f s) y

K_p, K_i, K_d proportional, integral (1/s) and derivative (s) gain; b weight of the reference;
T_f time constant of the derivative's filter, s; T_t tracking time of the anti-windup, s.
Astroem and Haegglund, Advanced PID Control (2006), sections 3.3 to 3.5: derivative on the
measurement alone, back-calculation against windup, integral set at the start so that nothing jumps.
"""

import math
from dataclasses import dataclass, replace

from slipbench.controllers.limits import Range


@dataclass(frozen=True, slots=True)
class PidState:
    """integral: I; slope: D; measurement: y of the last update; command: given last."""

    integral: float
    slope: float
    measurement: float
    command: float


@dataclass(frozen=True, slots=True)
class Pid:
    """See the head of this file; gains in the command's unit per the measurement's."""

    proportional: float
    integral: float
    derivative: float
    limits: Range
    filter_time: float = 0.005
    tracking_time: float = 0.05
    reference_weight: float = 1.0

    def __post_init__(self) -> None:
        """Raise ValueError where a time is not positive."""
        if not (self.filter_time > 0.0 and self.tracking_time > 0.0):
            raise ValueError("filter_time and tracking_time must be above 0 s")

    def start(self, command: float, reference: float, measurement: float) -> PidState:
        """Take over at `command` without a jump."""
        known = measurement if math.isfinite(measurement) else reference
        return PidState(command - self._proportional(reference, known), 0.0, known, command)

    def update(
        self, state: PidState, reference: float, measurement: float, dt: float
    ) -> tuple[float, PidState]:
        """The command for the next `dt` seconds, and the state after it."""
        if not math.isfinite(measurement + reference):
            return state.command, replace(state, slope=0.0)
        slope = self._slope(state, measurement, dt)
        requested = self._proportional(reference, measurement) + state.integral + slope
        command = self.limits.towards(requested, state.command, dt)
        back = min(dt / self.tracking_time, 1.0) * (command - requested)
        integral = state.integral + self.integral * (reference - measurement) * dt + back
        return command, PidState(integral, slope, measurement, command)

    def given(self, state: PidState, command: float, dt: float) -> PidState:
        """Track the part of the last command that the actuators gave, as at a limit."""
        back = min(dt / self.tracking_time, 1.0) * (command - state.command)
        return replace(state, integral=state.integral + back)

    def _proportional(self, reference: float, measurement: float) -> float:
        return self.proportional * (self.reference_weight * reference - measurement)

    def _slope(self, state: PidState, measurement: float, dt: float) -> float:
        """Filter the derivative by the implicit Euler rule: stable at every dt."""
        total = self.filter_time + dt
        moved = measurement - state.measurement
        return (self.filter_time * state.slope - self.derivative * moved) / total

    def between(self, other: "Pid", share: float) -> "Pid":
        """The controller at a share of the way to another one: gain scheduling."""
        if share <= 0.0:
            return self
        at = (1.0 - share, share)
        pairs = (
            (self.proportional, other.proportional),
            (self.integral, other.integral),
            (self.derivative, other.derivative),
        )
        p, i, d = (at[0] * a + at[1] * b for a, b in pairs)
        return replace(self, proportional=p, integral=i, derivative=d)
