"""An integration step of an FMU for model exchange, split at events.

An event is a sign change of an indicator (state event), a time event of the FMU, or a step event
that the FMU requests at the end of a step. The step is first integrated without events. An event is
then located on the cubic Hermite polynomial through the states and derivatives at both ends; the
FMU handles it there, and the remainder of the step is integrated again. So the time of an event is
a continuous function of the parameters.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.callables.fmu.derivatives import STAGES, Derivatives
from slipbench.identification.mismatch.callables.fmu.instance import Instance
from slipbench.identification.mismatch.callables.fmu.states import ContinuousStates
from slipbench.plant.signals import Floats

MOST_EVENTS = 5
"""Limit of the events located in one step; later ones, as of chattering, are handled at its end."""
TOLERANCE = 1e-9
"""Accuracy of an event location, as a fraction of the step."""


@dataclass(frozen=True, eq=False)
class Span:
    """A step. time: of its beginning, s; length: s. first, last: inputs at its ends, (inputs,)."""

    time: float
    length: float
    first: Floats
    last: Floats

    def at(self, share: float) -> float:
        """Return the time after a fraction of the step, s."""
        return self.time + share * self.length

    def inputs(self, share: float) -> Floats:
        """Return the inputs after a fraction of the step, shape (inputs,), in units of the FMU."""
        return self.first + share * (self.last - self.first)


class Step:
    """One step of one run."""

    def __init__(
        self, instance: Instance, states: ContinuousStates, span: Span, loop: Derivatives | None
    ) -> None:
        """loop: disturbances and effects on derivatives; None: there are none."""
        self._instance, self._states, self._span, self._loop = instance, states, span, loop

    def advance(self) -> bool:
        """Integrate the step and handle its events; return whether the FMU terminated."""
        begin, states = 0.0, self._states
        for count in range(MOST_EVENTS + 1):
            x, slope = self._integrate(begin)
            event = self._time_event_fraction() < 1.0 + TOLERANCE or states.crossed()
            if not event or count == MOST_EVENTS:
                return states.completed(event)
            begin = self._locate(begin, x, slope)
            if states.completed(event=True):
                return True
            if begin >= 1.0 - TOLERANCE:
                break
        return False

    def _time_event_fraction(self) -> float:
        """Return the fraction of the step at which the next time event lies."""
        return (self._states.next_event - self._span.time) / self._span.length

    def _integrate(self, begin: float) -> tuple[Floats, Floats]:
        """Integrate from a fraction of the step to its end.

        Returns states and derivatives at the beginning.
        """
        x, length = self._states.get(), (1.0 - begin) * self._span.length
        slopes: list[Floats] = []
        total = np.zeros_like(x)
        for number, (part, weight) in enumerate(STAGES):
            stage_state = x + part * length * slopes[-1] if slopes else x
            slopes.append(
                self._slope(begin + part * (1.0 - begin), stage_state, number, begin == 0.0)
            )
            total = total + weight * slopes[-1]
        if self._loop is not None and begin == 0.0:
            self._loop.end()
        self._put(1.0, x + length / 6.0 * total)
        return x, slopes[0]

    def _slope(self, share: float, x: Floats, number: int, complete: bool) -> Floats:
        """Return derivatives with disturbances and effects.

        whole: whether the stage belongs to the complete step, not to its repeated remainder.
        """
        self._put(share, x)
        slopes, inputs = self._states.rates(), self._span.inputs(share)
        if self._loop is None:
            return slopes
        if complete:
            return self._loop.acted(slopes, x, inputs, number)
        return self._loop.once(slopes, x, inputs, share)

    def _put(self, share: float, x: Floats, time: float | None = None) -> None:
        """Set inputs, time and states. time: exact time, s; None: that of the fraction."""
        span = self._span
        self._instance.set(self._instance.continuous, span.inputs(share))
        self._states.put(span.at(share) if time is None else time, x)

    def _locate(self, begin: float, x: Floats, slope: Floats) -> float:
        """Set the FMU to the first event after a fraction of the step; return its fraction.

        x, slope: states and derivatives at the beginning; the FMU is at the end of the step.
        """
        last = self._states.get()
        curve = Cubic(
            begin, self._span.length, (x, last), (slope, self._slope(1.0, last, 0, complete=False))
        )
        low, high = begin, min(max(self._time_event_fraction(), begin), 1.0)
        event_time = (
            self._states.next_event if self._time_event_fraction() < 1.0 + TOLERANCE else None
        )
        self._put(high, curve.at(high), event_time)
        if not self._states.crossed():
            return high
        while high - low > TOLERANCE:
            middle = 0.5 * (low + high)
            self._put(middle, curve.at(middle))
            low, high = (low, middle) if self._states.crossed() else (middle, high)
        self._put(high, curve.at(high))
        return high


@dataclass(frozen=True, eq=False)
class Cubic:
    """Cubic Hermite polynomial of the states from a fraction of a step to its end.

    x, slopes: states and derivatives at both ends; length: of the step, s.
    """

    begin: float
    length: float
    x: tuple[Floats, Floats]
    slopes: tuple[Floats, Floats]

    def at(self, share: float) -> Floats:
        """Return the states after a fraction of the step, shape (states,), in units of the FMU."""
        part = 1.0 - self.begin
        s, scale = (share - self.begin) / part, part * self.length
        (first, last), (k, m) = self.x, self.slopes
        line = (1.0 - s) * first + s * last
        cubic_part = (1.0 - 2.0 * s) * (last - first) + scale * ((s - 1.0) * k + s * m)
        return np.asarray(line + s * (s - 1.0) * cubic_part)
