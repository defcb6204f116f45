"""Slip control inside the tick: what arrives goes to the estimator, what it says to the controller.

It keeps the two states, and nothing else; laws and estimator are pure, and `permit` has the last
word on what comes out. The reference is the slip that stood when the button was pressed, or the
trial's own target, and what the trial's waveform adds.
"""

import math

from slipbench.bench.gateway.tooth_stream import ToothStream
from slipbench.bench.safety.trial import NOTHING, Asked, Plan
from slipbench.bench.safety.vehicle_monitor import Wheels
from slipbench.controllers.slip_controller import SlipController, SlipState, from_tree
from slipbench.controllers.slip_estimator import Slip, SlipEstimator
from slipbench.protocol.codec.messages import OpticalSpeed, ToothIntervals
from slipbench.protocol.database.layout import Database

USUAL = 0.3  # s over which the slip at the button is the mean
REPORT = 0.0065  # s: an encoder waits 5 ms for more teeth, and its frame is on the way


class SlipControl:
    """Listens all the time, so that it knows the teeth when the button is pressed."""

    def __init__(
        self, controller: SlipController, wheels: Wheels, modulo: int, target: float | None
    ) -> None:
        """Know nothing yet. modulo: of the tooth frames' count; target: slip, None for as found."""
        self._controller, self._target = controller, target
        self._estimator = SlipEstimator(
            wheels.teeth, wheels.rear_radius, wheels.front_radius, report=REPORT
        )
        self._known = self._estimator.initial()
        self._streams = {name: ToothStream(modulo) for name in ("RearTeeth", "FrontTeeth")}
        self._state: SlipState | None = None
        self._since = 0.0
        self._base = math.nan
        self._usual, self._heard = math.nan, 0.0
        self.asked = NOTHING
        _once(controller)

    def observe(self, name: str, message: object, now: float) -> None:
        """Take in a good frame of message `name` that arrived at `now` (s)."""
        if isinstance(message, ToothIntervals):
            take = (
                self._estimator.rear_tooth if name == "RearTeeth" else self._estimator.front_tooth
            )
            for time, count in self._streams[name].take(message, now):
                # Once in control, an oscillation could turn with the wheel: no more learning.
                self._known = take(self._known, time, float(count), self._state is None)
            if self._state is None:
                self._get_used_to(now)
        elif isinstance(message, OpticalSpeed) and message.valid:
            self._known = self._estimator.optical(self._known, now, message.speed)

    def _get_used_to(self, now: float) -> None:
        """Follow the slip as it is before the button: one sample of it is noisy."""
        seen = self.slip(now).value
        if math.isfinite(seen):
            share = min((now - self._heard) / USUAL, 1.0)
            known = self._usual if math.isfinite(self._usual) else seen
            self._usual, self._heard = known + share * (seen - known), now

    def slip(self, now: float) -> Slip:
        """Say what is known of the slip at `now` (s)."""
        return self._estimator.slip(self._known, now)

    def ask(self, waveform: float, now: float) -> Asked:
        """Control for one tick. waveform: what the trial adds to the target now."""
        seen = self.slip(now)
        if not math.isfinite(self._base):  # at first, or as long as the slip is not known
            found = self._usual if math.isfinite(self._usual) else seen.value
            self._base = found if self._target is None else self._target
        if self._state is None:
            self._state = self._controller.start(0.0, 0.0, seen.value, seen.speed)
            self._since = now - 0.001
        target = self._base + waveform
        throttle, spark, self._state = self._controller.update(
            self._state, target, seen.value, seen.speed, now - self._since
        )
        self._since = now
        self.asked = Asked(throttle, spark)
        return self.asked


def _once(controller: SlipController) -> None:
    """Control nothing, once, before the ticks: what a first call loads and solves takes its time.

    In the loop, where memory is locked, it held the first tick with authority up for 11 ms.
    """
    controller.update(controller.start(0.0, 0.0, 0.0, 50.0), 0.0, 0.0, 50.0, 0.001)


def slip_control(plan: Plan, wheels: Wheels, database: Database) -> SlipControl | None:
    """Make what a plan's controller needs; None where the plan has none."""
    if plan.controller is None or plan.trial.controller is None:
        return None
    controller = from_tree(plan.controller.model_dump())
    return SlipControl(controller, wheels, tooth_modulo(database), plan.trial.controller.target)


def tooth_modulo(database: Database) -> int:
    """Tell at which count the tooth frames start again."""
    message = next(m for m in database.messages if m.name == "RearTeeth")
    return 1 << next(s.length for s in message.signals if s.name == "tooth_count")
