"""Peripheral speed of a wheel over its last turn: the tooth-pitch errors of a turn add up to zero."""

import math
from collections import deque

from slipbench.bench.safety.vehicle_monitor import SLOWEST, Wheels
from slipbench.protocol.codec.messages import Intervals, ToothIntervals


class TurnSpeed:
    """Mean of the rear wheel over as many teeth as a turn has, or those that came so far."""

    def __init__(self, wheels: Wheels, *, averaged: bool = True) -> None:
        """Begin without a tooth. averaged: False where the bus has a speed in place of teeth."""
        self._pitch = 2 * math.pi * wheels.rear_radius / wheels.teeth
        self._intervals: deque[float] = deque(maxlen=wheels.teeth if averaged else 1)
        self._waited = 0.0

    def observe(self, teeth: ToothIntervals) -> None:
        """Process the intervals of a frame; at standstill, the time without a tooth."""
        if teeth.layout == Intervals.STANDING:
            self._waited = sum(teeth.intervals)
            return
        self._waited = 0.0
        self._intervals.extend(teeth.intervals)

    @property
    def speed(self) -> float:
        """Speed in m/s; NaN before the first tooth. While no tooth comes, the most that is possible."""
        span = sum(self._intervals)
        if span <= 0.0:
            return math.nan
        mean = self._pitch * len(self._intervals) / span
        return mean if self._waited <= 0.0 else min(mean, self._pitch / self._waited)

    def slip(self, speed: float) -> float:
        """Slip against a speed in m/s; NaN where that is too low."""
        return self.speed / speed - 1.0 if speed > SLOWEST else math.nan
