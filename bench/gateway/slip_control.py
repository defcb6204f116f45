"""Slip control inside the tick: frames to the estimator, its slip to the controller.

It keeps the two states, and nothing else; laws and estimator are pure functions, and `permit`
checks every command. The setpoint is the slip when the button was pressed, or the target of the
trial, plus the waveform of the trial.
"""

import math

from slipbench.bench.gateway.tooth_stream import ToothStream
from slipbench.bench.safety.trial import NO_OFFSETS, Offsets, Plan
from slipbench.bench.safety.vehicle_monitor import Wheels
from slipbench.controllers.slip_controller import SlipController, SlipState, from_tree
from slipbench.controllers.slip_estimator import Slip, SlipEstimator
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import OpticalSpeed, ToothIntervals
from slipbench.protocol.codec.wire import TeethPart

NEVER = 1 << 62  # modulo of a count that does not wrap
MEAN_TIME = 0.3  # s, of the mean slip before the button
REPORT = 0.0065  # s: an encoder waits 5 ms for more teeth, and its frame is on the way


class SlipControl:
    """Controller and estimator; the estimator runs before the button, so that it has learned the teeth."""

    def __init__(
        self, controller: SlipController, wheels: Wheels, modulo: int, target: float | None
    ) -> None:
        """modulo: of the count in tooth frames; target: slip, None for the slip at the button."""
        self._controller, self._target = controller, target
        self._estimator = SlipEstimator(
            wheels.teeth, wheels.rear_radius, wheels.front_radius, report=REPORT
        )
        self._estimate = self._estimator.initial()
        self._streams = {name: ToothStream(modulo) for name in ("RearTeeth", "FrontTeeth")}
        self._state: SlipState | None = None
        self._since = 0.0
        self._setpoint = math.nan
        self._mean_slip, self._updated = math.nan, 0.0
        self.requested = NO_OFFSETS
        _warm_up(controller)

    def observe(self, name: str, message: object, now: float) -> None:
        """Use a good frame of message `name` that arrived at `now` (s)."""
        if isinstance(message, ToothIntervals):
            take = (
                self._estimator.rear_tooth if name == "RearTeeth" else self._estimator.front_tooth
            )
            for time, count in self._streams[name].take(message, now):
                # Once in control, an oscillation could turn with the wheel: no more learning.
                self._estimate = take(self._estimate, time, float(count), self._state is None)
            if self._state is None:
                self._update_mean_slip(now)
        elif isinstance(message, OpticalSpeed) and message.valid:
            self._estimate = self._estimator.optical(self._estimate, now, message.speed)

    def _update_mean_slip(self, now: float) -> None:
        """Mean of the slip before the button: one sample is noisy."""
        slip = self.slip(now).value
        if math.isfinite(slip):
            share = min((now - self._updated) / MEAN_TIME, 1.0)
            known = self._mean_slip if math.isfinite(self._mean_slip) else slip
            self._mean_slip, self._updated = known + share * (slip - known), now

    def slip(self, now: float) -> Slip:
        """Estimated slip at `now` (s)."""
        return self._estimator.slip(self._estimate, now)

    def update(self, waveform: float, now: float) -> Offsets:
        """Requested offsets at `now` (s). waveform: slip that the trial adds to the setpoint."""
        slip = self.slip(now)
        if not math.isfinite(self._setpoint):  # at first, or while the slip is unknown
            found = self._mean_slip if math.isfinite(self._mean_slip) else slip.value
            self._setpoint = found if self._target is None else self._target
        if self._state is None:
            self._state = self._controller.start(0.0, 0.0, slip.value, slip.speed)
            self._since = now - 0.001
        target = self._setpoint + waveform
        throttle, spark, self._state = self._controller.update(
            self._state, target, slip.value, slip.speed, now - self._since
        )
        self._since = now
        self.requested = Offsets(throttle, spark)
        return self.requested


def _warm_up(controller: SlipController) -> None:
    """Run the controller once before the ticks: the first call loads and solves, which takes time.

    In the loop, where memory is locked, it delayed the first tick with authority by 11 ms.
    """
    controller.update(controller.start(0.0, 0.0, 0.0, 50.0), 0.0, 0.0, 50.0, 0.001)


def slip_control(plan: Plan, wheels: Wheels, codec: Codec) -> SlipControl | None:
    """Slip control of a plan; None where the plan has no controller."""
    if plan.controller is None or plan.trial.controller is None:
        return None
    controller = from_tree(plan.controller.model_dump())
    return SlipControl(controller, wheels, tooth_modulo(codec), plan.trial.controller.target)


def tooth_modulo(codec: Codec) -> int:
    """Modulo of the tooth count in the tooth frames; that of wheel speeds does not wrap."""
    parts = codec.parts("RearTeeth") if codec.has("RearTeeth") else []
    return next((part.modulo for part in parts if isinstance(part, TeethPart)), NEVER)
