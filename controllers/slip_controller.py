"""A slip controller as a bench runs it: from wanted and seen slip to throttle and spark.

Throttle and spark are told as offsets from where they rested at the start, in SI. One interface for
throttle, spark and mixed control; `from_tree` makes any of them from the numbers of a file.

    controller = from_tree(tree)
    state = controller.start(0.0, 0.0, slip, speed)
    throttle, spark, state = controller.update(state, target, slip, speed, 0.001)
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from controllers.governor import Governor
from controllers.internal_model import InternalModel
from controllers.law import Law
from controllers.limits import Range
from controllers.linear import in_series
from controllers.mid_ranging import MidRanging
from controllers.pid import Pid
from controllers.schedule import Schedule


@dataclass(frozen=True, slots=True)
class SlipState:
    """law: state of the law; reference: slip asked for last; throttle, spark: given last."""

    law: Any
    reference: float
    throttle: float
    spark: float


@dataclass(frozen=True)
class SlipController:
    """actuator: "throttle", "spark" or "mixed"; law: from slip to it (to the spark, where mixed);
    schedule: laws by speed, in place of `law`; slow: what relieves the spark, where mixed."""

    actuator: str
    law: Law[Any]
    governor: Governor | None = None
    schedule: Schedule | None = None
    slow: MidRanging[Any] | None = None

    def start(self, throttle: float, spark: float, slip: float, speed: float) -> SlipState:
        """Take over at offsets of throttle and spark without a jump, asking for the slip there is.

        The first target then comes as a change of the reference like any later one.
        """
        if self.slow is not None:
            mixed = self.slow.start(throttle, spark, slip, slip)
            return SlipState(mixed, slip, throttle, spark)
        now = throttle if self.actuator == "throttle" else spark
        return SlipState(self._at(speed).start(now, slip, slip), slip, throttle, spark)

    def update(
        self, state: SlipState, target: float, slip: float, speed: float, dt: float
    ) -> tuple[float, float, SlipState]:
        """Return the offsets of throttle and spark for the next `dt` s, and the state after."""
        reference = self._governed(state, target, dt)
        if self.slow is not None:
            throttle, spark, mixed = self.slow.update(state.law, reference, slip, dt)
            return throttle, spark, SlipState(mixed, reference, throttle, spark)
        command, law = self._at(speed).update(state.law, reference, slip, dt)
        throttle, spark = (
            (command, state.spark) if self._moves_throttle else (state.throttle, command)
        )
        return throttle, spark, SlipState(law, reference, throttle, spark)

    @property
    def _moves_throttle(self) -> bool:
        return self.actuator == "throttle"

    def _at(self, speed: float) -> Law[Any]:
        return self.schedule.at(speed) if self.schedule is not None else self.law

    def _governed(self, state: SlipState, target: float, dt: float) -> float:
        if self.governor is None:
            return target
        now = state.throttle if self._moves_throttle else state.spark
        return self.governor.update(state.reference, target, now, dt)


def from_tree(tree: Mapping[str, Any]) -> SlipController:
    """Make a controller from the numbers of a controller file, SI, already checked."""
    limits = _range(tree["limits"])
    law = _law(tree["law"], limits, tree["period"])
    rows = tree.get("schedule") or ()
    schedule = (
        Schedule(tuple((r["speed"], _pid(r["gains"], limits)) for r in rows)) if rows else None
    )
    governed = tree.get("governor")
    governor = Governor(_range(governed["slip"]), governed["gain"], limits) if governed else None
    mixed = tree.get("mixed")
    slow = (
        MidRanging(law, _range(mixed["throttle"]), mixed["exchange"], mixed["time"], mixed["rest"])
        if mixed else None
    )  # fmt: skip
    return SlipController(tree["actuator"], law, governor, schedule, slow)


def _range(tree: Mapping[str, float]) -> Range:
    return Range(tree["low"], tree["high"], tree["rate"])


def _law(tree: Mapping[str, Any], limits: Range, period: float) -> Law[Any]:
    if tree["kind"] == "pid":
        return _pid(tree, limits)
    model, inverse = in_series(tree["model"]), in_series(tree["inverse"])
    return InternalModel(model, inverse, tree["delay"], period, limits)


def _pid(tree: Mapping[str, float], limits: Range) -> Pid:
    return Pid(
        tree["proportional"], tree["integral"], tree["derivative"], limits,
        tree["filter_time"], tree["tracking_time"], tree["reference_weight"],
    )  # fmt: skip
