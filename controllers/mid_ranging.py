"""Spark acts at once, the throttle takes over, and the spark returns to its optimum.

    dtheta = k F u,   F = 1 / (1 + T s),   s = u - M dtheta / k

u what the fast law asks for, in spark (rad); s spark command; dtheta throttle deviation; k = g_s /
g_t throttle per spark with the same slip at rest; T time of the throttle's taking over, s; M how
much later than a spark the throttle acts: G_t / G_s with gain 1 at rest. What the throttle does
already, the spark leaves: together they do to the slip what the spark alone would, G_s u, so that
the loop and its reserves are those of the spark; and u may go as far as both reach. Mid-ranging
control (Allison and Isaksson 1998) with the slow actuator's model, as in habituating control
(Henson, Ogunnaike and Schwaber 1995). Where a limit keeps the spark from what is left to it, the
law is told what the two could give, and winds nothing up.
"""

import math
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from controllers.law import Law
from controllers.limits import Range
from controllers.linear import Floats, Linear

State = TypeVar("State")


@dataclass(frozen=True, eq=False, slots=True)
class MixedState(Generic[State]):
    """fast: state of the fast law; share: F u, rad; late: what the throttle gave in spark, on its
    way, newest first; through: state of M; throttle, spark: given last."""

    fast: State
    share: float
    late: tuple[float, ...]
    through: Floats
    throttle: float
    spark: float


@dataclass(frozen=True, eq=False)
class MidRanging(Generic[State]):
    """fast: the law from slip to u, its limits those of `reach`; through, delay: M without its
    delay, and that in periods of `period` s; see the head of this file for the rest."""

    fast: Law[State]
    spark: Range
    throttle: Range
    exchange: float  # k, throttle per rad
    time: float  # T, s
    through: Linear
    delay: int
    period: float

    def __post_init__(self) -> None:
        """Raise ValueError for a time of zero, or where a spark is worth no throttle."""
        if not (self.time > 0.0 and self.exchange != 0.0):
            raise ValueError("mid-ranging needs a time above 0 s, and an exchange")

    def start(
        self, throttle: float, spark: float, reference: float, measurement: float
    ) -> MixedState[State]:
        """Take over at a throttle deviation and a spark offset without a jump."""
        share = throttle / self.exchange
        fast = self.fast.start(spark + share, reference, measurement)
        late = (share,) * (self.delay + 1)
        return MixedState(fast, share, late, self.through.rest(share), throttle, spark)

    def update(
        self, state: MixedState[State], reference: float, measurement: float, dt: float
    ) -> tuple[float, float, MixedState[State]]:
        """Return throttle deviation, spark offset, and the state after them.

        A longer step than `period` is run as several.
        """
        wanted, fast = self.fast.update(state.fast, reference, measurement, dt)
        for _ in range(max(round(dt / self.period), 1)):
            state = self._step(state, wanted)
        done = self._done(state)
        fast = self.fast.given(fast, state.spark + done, dt)
        state = MixedState(
            fast, state.share, state.late, state.through, state.throttle, state.spark
        )
        return state.throttle, state.spark, state

    def _step(self, state: MixedState[State], wanted: float) -> MixedState[State]:
        quick = 1.0 - math.exp(-self.period / self.time)
        share = state.share + quick * (wanted - state.share)
        throttle = self.throttle.towards(self.exchange * share, state.throttle, self.period)
        through = self.through.A @ state.through + self.through.B * state.late[-1]
        late = (throttle / self.exchange, *state.late[:-1])
        done = float(self.through.C @ through) + self.through.D * late[-1]
        spark = self.spark.towards(wanted - done, state.spark, self.period)
        return MixedState(state.fast, share, late, np.asarray(through), throttle, spark)

    def _done(self, state: MixedState[State]) -> float:
        """Spark that the throttle stands for by now, rad."""
        return float(self.through.C @ state.through) + self.through.D * state.late[-1]


def reach(spark: Range, throttle: Range, exchange: float) -> Range:
    """Return what spark and throttle give together, in spark, rad."""
    ends = [throttle.low / exchange, throttle.high / exchange]
    return Range(spark.low + min(ends), spark.high + max(ends), spark.rate)
