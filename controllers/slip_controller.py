"""A slip controller as a bench runs it: from requested and measured slip to throttle and spark.

Throttle and spark are offsets from where they rested at the start, in SI. One interface for
throttle, spark and mixed control; `from_tree` makes any of them from the numbers of a file.

    controller = from_tree(tree)
    state = controller.start(0.0, 0.0, slip, speed)
    throttle, spark, state = controller.update(state, target, slip, speed, 0.001)
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from slipbench.controllers.compensator import Compensator
from slipbench.controllers.governor import Governor
from slipbench.controllers.internal_model import InternalModel
from slipbench.controllers.law import Law
from slipbench.controllers.limits import Range
from slipbench.controllers.linear import Linear, in_series
from slipbench.controllers.pid import Pid
from slipbench.controllers.schedule import Schedule
from slipbench.controllers.two_actuators import TwoActuators, reach


@dataclass(frozen=True, slots=True)
class SlipState:
    """law: state of the law; reference: last requested slip; passed: state of the prefilter;
    throttle, spark: given last."""

    law: Any
    reference: float
    passed: Any
    throttle: float
    spark: float


@dataclass(frozen=True)
class SlipController:
    """actuator: "throttle", "spark" or "mixed"; law: from slip to it (to the spark, where mixed);
    schedule: laws by speed, in place of `law`; both: the law through both, where mixed; prefilter:
    what the reference goes through, gain 1. More throttle and more spark are more slip."""

    actuator: str
    law: Law[Any]
    governor: Governor | None = None
    schedule: Schedule | None = None
    both: TwoActuators | None = None
    prefilter: Linear | None = None

    def start(self, throttle: float, spark: float, slip: float, speed: float) -> SlipState:
        """Take over at offsets of throttle and spark without a jump, asking for the slip there is.

        The first target then comes as a change of the reference like any later one. A slip that is
        not known yet: throttle and spark stay until it is.
        """
        passed = self.prefilter.rest(slip) if self.prefilter is not None else None
        if self.both is not None:
            law: Any = self.both.start(throttle, spark, slip, slip)
        else:
            now = throttle if self._moves_throttle else spark
            law = self._at(speed).start(now, slip, slip)
        return SlipState(law, slip, passed, throttle, spark)

    def update(
        self, state: SlipState, target: float, slip: float, speed: float, dt: float
    ) -> tuple[float, float, SlipState]:
        """The offsets of throttle and spark for the next `dt` s, and the state after."""
        if not math.isfinite(state.reference):
            return state.throttle, state.spark, self.start(state.throttle, state.spark, slip, speed)
        reference = self._governed(state, target, dt)
        shaped, passed = self._passed(state, reference)
        throttle, spark = state.throttle, state.spark
        if self.both is not None:
            throttle, spark, law = self.both.update(state.law, shaped, slip, dt)
        elif self._moves_throttle:
            throttle, law = self._at(speed).update(state.law, shaped, slip, dt)
        else:
            spark, law = self._at(speed).update(state.law, shaped, slip, dt)
        return throttle, spark, SlipState(law, reference, passed, throttle, spark)

    def _passed(self, state: SlipState, reference: float) -> tuple[float, Any]:
        """The reference behind the prefilter, and the state of that.

        A prefilter shapes a change of the target so that the slip does not oscillate. A change of
        which a limit gives nothing goes past it: swinging back, it would ask for less than the
        target.
        """
        if self.prefilter is None:
            return reference, None
        p, x, change = self.prefilter, state.passed, reference - state.reference
        if self._in_vain(state, change):
            x = x + p.rest(change)
        return float(p.C @ x) + p.D * reference, p.A @ x + p.B * reference

    def _in_vain(self, state: SlipState, change: float) -> bool:
        """Whether a change of the target only drives the command further into a limit."""
        by_throttle = self.both is not None or self._moves_throttle
        law = self.law if self.both is None else self.both.throttle
        now = state.throttle if by_throttle else state.spark
        return law.limits.withstands(change, now)

    @property
    def _moves_throttle(self) -> bool:
        return self.actuator == "throttle"

    def _at(self, speed: float) -> Law[Any]:
        return self.schedule.at(speed) if self.schedule is not None else self.law

    def _governed(self, state: SlipState, target: float, dt: float) -> float:
        if self.governor is None:
            return target
        if self.both is not None:
            now = state.spark + state.throttle / self.both.exchange
        else:
            now = state.throttle if self._moves_throttle else state.spark
        return self.governor.update(state.reference, target, now, dt)


def from_tree(tree: Mapping[str, Any]) -> SlipController:
    """Make a controller from the numbers of a controller file, SI, already checked."""
    limits, mixed, period = _range(tree["limits"]), tree.get("mixed"), tree["period"]
    far = limits
    if mixed:
        far = reach(limits, _range(mixed["throttle"]), mixed["exchange"])
    law = _law(tree["law"], limits, period)
    both = _both(mixed, law, period) if mixed else None
    rows = tree.get("schedule") or ()
    schedule = (
        Schedule(tuple((r["speed"], _pid(r["gains"], limits)) for r in rows)) if rows else None
    )
    governed = tree.get("governor")
    governor = Governor(_range(governed["slip"]), governed["gain"], far) if governed else None
    passed = in_series(tree["prefilter"]) if tree.get("prefilter") else None
    return SlipController(tree["actuator"], law, governor, schedule, both, passed)


def _both(tree: Mapping[str, Any], spark: Law[Any], period: float) -> TwoActuators:
    throttle = _law(tree["law"], _range(tree["throttle"]), period)
    assert isinstance(throttle, InternalModel)
    assert isinstance(spark, InternalModel)
    return TwoActuators(
        throttle, spark, in_series(tree["later"]), tree["delay"], tree["zone"], tree["exchange"]
    )


def _range(tree: Mapping[str, float]) -> Range:
    return Range(tree["low"], tree["high"], tree["rate"])


def _law(tree: Mapping[str, Any], limits: Range, period: float) -> Law[Any]:
    if tree["kind"] == "pid":
        return _pid(tree, limits)
    if tree["kind"] == "linear":
        shaping = in_series(tree["shaping"])
        return Compensator(tree["integral"], shaping, period, limits, tree["tracking_time"])
    model, inverse = in_series(tree["model"]), in_series(tree["inverse"])
    return InternalModel(model, inverse, tree["delay"], period, limits)


def _pid(tree: Mapping[str, float], limits: Range) -> Pid:
    return Pid(
        tree["proportional"],
        tree["integral"],
        tree["derivative"],
        limits,
        tree["filter_time"],
        tree["tracking_time"],
        tree["reference_weight"],
    )
