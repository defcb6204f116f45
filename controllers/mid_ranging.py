"""Spark acts at once, the throttle takes over slowly, and the spark returns to its optimum.

    dtheta' = (g_s / g_t) (s - s_0) / T

s spark command, s_0 where it is to rest (rad), dtheta throttle deviation, g_s and g_t slip per unit
of spark and of throttle at low frequency, T the time in which the throttle takes over (s).
Mid-ranging control (Allison and Isaksson 1998), with the throttle as the slow actuator: the engine
leaves its optimum only for a moment.
"""

from dataclasses import dataclass
from typing import Generic, TypeVar

from controllers.law import Law
from controllers.limits import Range

State = TypeVar("State")


@dataclass(frozen=True, slots=True)
class MixedState(Generic[State]):
    """spark: state of the fast law; throttle: deviation given last, 0..1."""

    spark: State
    throttle: float


@dataclass(frozen=True)
class MidRanging(Generic[State]):
    """fast: the law from slip to spark; see the head of this file for the rest."""

    fast: Law[State]
    throttle: Range
    exchange: float  # g_s / g_t, throttle per rad
    time: float  # T, s
    rest: float = 0.0  # s_0, rad

    def __post_init__(self) -> None:
        """Raise ValueError for a time of zero."""
        if not self.time > 0.0:
            raise ValueError("mid-ranging needs a time above 0 s")

    def start(
        self, throttle: float, spark: float, reference: float, measurement: float
    ) -> MixedState[State]:
        """Take over at a throttle deviation and a spark offset without a jump."""
        return MixedState(self.fast.start(spark, reference, measurement), throttle)

    def update(
        self, state: MixedState[State], reference: float, measurement: float, dt: float
    ) -> tuple[float, float, MixedState[State]]:
        """Return throttle deviation, spark offset, and the state after them."""
        spark, fast = self.fast.update(state.spark, reference, measurement, dt)
        pace = self.exchange * (spark - self.rest) / self.time
        throttle = self.throttle.towards(state.throttle + pace * dt, state.throttle, dt)
        return throttle, spark, MixedState(fast, throttle)
