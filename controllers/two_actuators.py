"""The throttle holds the slip; the spark helps where it is too slow, and returns to its optimum.

    d = y - G_t theta - G_s s            what the models did not expect
    theta = theta_r + Q_t (-d),   theta_r = Q_t r
    s = z(Q_s (-d) - M (theta - theta_r) / k)

theta throttle, s spark command, y slip, r target, all from where they stood at the start; G models,
Q inverses; M = G_t / G_s with gain 1 at rest, how much later than a spark the throttle acts; k
throttle per spark with the same slip. The throttle holds the slip by internal model control; the
spark does at once what a loop of its own would, and leaves what the throttle does by now. In steady
state that is all, and the spark stands at its optimum (mid-ranging, Allison and Isaksson 1998; by
models, as in habituating control, Henson, Ogunnaike and Schwaber 1995). A target is the throttle's
alone, as far as it reaches.

z is a dead zone: what sensor noise can explain is no reason to leave the optimum. Where it passes a
share n of the spark, the loop is n times the spark's own and 1 - n times the throttle's own. Limits
and dead zone lie outside the models' loop, where they unsettle nothing: the models are driven by
what was given (Morari and Zafiriou, Robust Process Control, 1989, sections 3.1 and 7.1).
"""

import math
from dataclasses import dataclass

import numpy as np

from slipbench.controllers.internal_model import InternalModel
from slipbench.controllers.limits import Range
from slipbench.controllers.linear import Floats, Linear

Line = tuple[float, ...]
"""Delayed values, newest first."""


@dataclass(frozen=True, eq=False, slots=True)
class TwoState:
    """target: state of Q_t r; inverses, models: of Q_t, Q_s and G_t, G_s; later: of M; throttles,
    sparks, relieved: throttle, spark and what the throttle relieves, on their way into the models;
    throttle, spark: given last; base: throttle, spark and slip at the start."""

    target: Floats
    inverses: tuple[Floats, Floats]
    models: tuple[Floats, Floats]
    later: Floats
    throttles: Line
    sparks: Line
    relieved: Line
    throttle: float
    spark: float
    base: tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class TwoActuators:
    """throttle, spark: internal model control through either, models strictly proper; later: M
    without its delay, and that in periods; zone: half the dead zone, rad; exchange: k."""

    throttle: InternalModel
    spark: InternalModel
    later: Linear
    delay: int
    zone: float
    exchange: float

    def start(
        self, throttle: float, spark: float, reference: float, measurement: float
    ) -> TwoState:
        """Take over at a throttle deviation and a spark offset without a jump."""
        known = measurement if math.isfinite(measurement) else reference
        slow, fast = self.throttle, self.spark
        begun = slow.start(throttle, reference, known)
        return TwoState(
            begun.inverse,
            (_rest(slow.inverse), _rest(fast.inverse)),
            (_rest(slow.model), _rest(fast.model)),
            _rest(self.later),
            (0.0,) * slow.delay,
            (0.0,) * fast.delay,
            (0.0,) * self.delay,
            throttle,
            spark,
            (throttle, spark, known),
        )

    def update(
        self, state: TwoState, reference: float, measurement: float, dt: float
    ) -> tuple[float, float, TwoState]:
        """Throttle deviation, spark offset, and the state after them.

        A longer step than the laws' own is run as several. While the slip is unknown both commands
        are held, and the models go on.
        """
        for _ in range(max(round(dt / self.throttle.period), 1)):
            state = self._step(state, reference, measurement)
        return state.throttle, state.spark, state

    def _step(self, state: TwoState, reference: float, measurement: float) -> TwoState:
        slow, fast, later = self.throttle, self.spark, self.later
        (q_t, q_s), (g_t, g_s), target = state.inverses, state.models, state.target
        rest_t, rest_s, level = state.base
        throttle, spark, relieved = (
            state.throttle,
            state.spark,
            (*state.relieved[:1], *state.relieved),
        )
        if math.isfinite(measurement):
            error = reference - level
            d = measurement - level - float(slow.model.C @ g_t) - float(fast.model.C @ g_s)
            feedforward = float(slow.inverse.C @ target) + slow.inverse.D * error
            feedback = float(slow.inverse.C @ q_t) - slow.inverse.D * d
            throttle = slow.limits.towards(rest_t + feedforward + feedback, throttle, slow.period)
            relieved = ((throttle - rest_t - feedforward) / self.exchange, *state.relieved)
            alone = float(fast.inverse.C @ q_s) - fast.inverse.D * d
            done = float(later.C @ state.later) + later.D * relieved[-1]
            spark = fast.limits.towards(rest_s + self._worth(alone - done), spark, slow.period)
            excess = rest_t + slow.inverse.gain * (error - d) - throttle
            go_on = _settled if slow.limits.withstands(excess, throttle) else _after
            target, q_t = go_on(slow.inverse, target, error), go_on(slow.inverse, q_t, -d)
            q_s = _after(fast.inverse, q_s, -d)
        throttles, sparks = (throttle - rest_t, *state.throttles), (spark - rest_s, *state.sparks)
        return TwoState(
            target,
            (q_t, q_s),
            (_after(slow.model, g_t, throttles[-1]), _after(fast.model, g_s, sparks[-1])),
            _after(later, state.later, relieved[-1]),
            throttles[:-1],
            sparks[:-1],
            relieved[:-1],
            throttle,
            spark,
            state.base,
        )

    def _worth(self, spark: float) -> float:
        """Leave out what lies in the dead zone."""
        return math.copysign(max(abs(spark) - self.zone, 0.0), spark)


def _rest(system: Linear) -> Floats:
    return np.zeros(system.B.size)


def _after(system: Linear, x: Floats, u: float) -> Floats:
    return np.asarray(system.A @ x + system.B * u)


def _settled(system: Linear, _: Floats, u: float) -> Floats:
    """Forget the past, as `InternalModel` does at a limit."""
    return system.rest(u)


def reach(spark: Range, throttle: Range, exchange: float) -> Range:
    """Range of spark and throttle together, in spark, rad."""
    ends = [throttle.low / exchange, throttle.high / exchange]
    return Range(spark.low + min(ends), spark.high + max(ends), spark.rate)
