"""Slip estimate for a controller: from tooth times as they come, and true speed while measured.

    lambda = w_r r_r / v - 1

w_r rear wheel speed from its last tooth interval, free of tooth-pitch errors; r_r rolling radius; v
speed: the optical sensor's while it reports, else the front wheel's. The ratio of the front wheel's
speed to the optical one (its rolling radius changes with load and pressure) is learnt while both
report, so that nothing jumps when the optical sensor is lost or returns. A wheel speed is the
mean over one gap and half an interval old when its tooth comes; `age` gives it, and the design of
the loop counts it.

A controller that takes a dead encoder for a slow wheel opens the throttle. So a tooth that fails to
come makes the slip unknown, and so does a slip further below zero than drive can make it: the
controller then holds, and the safety gate judges.
"""

import math
from dataclasses import dataclass
from functools import cached_property

from slipbench.controllers.pitch_learner import LearnerState, PitchLearner
from slipbench.controllers.speed_tracker import SpeedTracker, Track

UNKNOWN = Track()
SLOWEST = 3.0  # m/s: below it a slip is noise over nothing
OVERDUE = 1.5  # of the last interval: a tooth that is later has been lost, or the wheel stands


@dataclass(frozen=True, slots=True)
class Wheel:
    """learner: of its gaps; speed: rad/s, of the last interval; time: of the last tooth, s."""

    learner: LearnerState
    speed: float = math.nan
    time: float = -math.inf
    interval: float = math.nan


@dataclass(frozen=True, slots=True)
class EstimatorState:
    """State. optical: the optical sensor's speed; scale: true over front wheel's."""

    rear: Wheel
    front: Wheel
    optical: Track = UNKNOWN
    scale: float = 1.0


@dataclass(frozen=True, slots=True)
class Slip:
    """value: slip, NaN where unknown; speed: m/s; age: s, of the value; source: of the speed."""

    value: float
    speed: float
    age: float
    source: str


@dataclass(frozen=True)
class SlipEstimator:
    """teeth: per turn of either encoder; radii: m, rolling; silence: s after which a sensor is
    lost; memory: s over which the front wheel's scale is learnt; report: s after which teeth that
    have passed are reported at the latest: a silence of that length carries no information."""

    teeth: int
    rear_radius: float
    front_radius: float
    silence: float = 0.015
    memory: float = 2.0
    report: float = 0.0
    limit: float = 0.05  # the front wheel's scale stays within 1 +- this
    lowest: float = -0.03  # slip below it is a brake's, a seizure's, or of teeth that were lost

    @cached_property
    def learner(self) -> PitchLearner:
        """Learner of the tooth-pitch errors of either wheel."""
        return PitchLearner(self.teeth)

    @cached_property
    def tracker(self) -> SpeedTracker:
        """Filter of the optical sensor's readings."""
        return SpeedTracker(silence=self.silence)

    def initial(self) -> EstimatorState:
        """State before the first sample."""
        return EstimatorState(Wheel(self.learner.initial()), Wheel(self.learner.initial()))

    def rear_tooth(
        self, state: EstimatorState, time: float, count: float, learning: bool = True
    ) -> EstimatorState:
        """Add a tooth of the rear wheel. time: s; count: running number."""
        rear = self._tooth(state.rear, time, count, learning)
        return EstimatorState(rear, state.front, state.optical, state.scale)

    def front_tooth(
        self, state: EstimatorState, time: float, count: float, learning: bool = True
    ) -> EstimatorState:
        """Add a tooth of the front wheel; the scale is learnt while the optical sensor reports."""
        front = self._tooth(state.front, time, count, learning)
        scale = (
            self._scale(state, front) if time - state.optical.time <= self.silence else state.scale
        )
        return EstimatorState(state.rear, front, state.optical, scale)

    def optical(self, state: EstimatorState, time: float, speed: float) -> EstimatorState:
        """Take in a valid reading of the optical sensor, m/s."""
        if speed != speed:
            return state
        return EstimatorState(
            state.rear, state.front, self.tracker.update(state.optical, time, speed), state.scale
        )

    def slip(self, state: EstimatorState, now: float) -> Slip:
        """Slip at `now`, where wheel and vehicle speed are known and the drive can explain it."""
        speed, source = self._speed(state, now)
        rear = self._still(state.rear, now) * self.rear_radius
        value = rear / speed - 1.0 if speed > SLOWEST else math.nan
        age = now - state.rear.time + 0.5 * state.rear.interval
        return Slip(value if value >= self.lowest else math.nan, speed, age, source)

    def _scale(self, state: EstimatorState, front: Wheel) -> float:
        own = front.speed * self.front_radius
        if not own > SLOWEST:
            return state.scale
        share = min(front.interval / self.memory, 1.0)
        measured = min(max(state.optical.speed / own, 1.0 - self.limit), 1.0 + self.limit)
        return state.scale + share * (measured - state.scale)

    def _speed(self, state: EstimatorState, now: float) -> tuple[float, str]:
        if now - state.optical.time <= self.silence:
            return state.optical.at(now), "optical"
        front = self._still(state.front, now) * self.front_radius * state.scale
        return (front, "front wheel") if math.isfinite(front) else (math.nan, "unknown")

    def _tooth(self, wheel: Wheel, time: float, count: float, learning: bool) -> Wheel:
        speed, learner = self.learner.update(wheel.learner, time, count, learning)
        return Wheel(learner, speed, time, time - wheel.time if speed == speed else math.nan)

    def _still(self, wheel: Wheel, now: float) -> float:
        """Speed of a wheel, rad/s; unknown where a tooth fails to come."""
        silence = now - wheel.time - self.report
        return wheel.speed if not silence > OVERDUE * wheel.interval else math.nan
