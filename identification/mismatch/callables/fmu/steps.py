"""A step of integration of an FMU for model exchange, cut where events lie in it.

An event is a sign change of an indicator, a time that the FMU announced, or one that it asks for when a
step is complete. The step is integrated as if there were none; the event is located on the cubic through
the states and derivatives of both ends; the FMU handles it there, and the remainder is integrated anew.
So where an event lies changes without jumps when a parameter changes.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.callables.fmu.derivatives import STAGES, Derivatives
from slipbench.identification.mismatch.callables.fmu.instance import Instance
from slipbench.identification.mismatch.callables.fmu.states import ContinuousStates
from slipbench.plant.signals import Floats

MOST_EVENTS = 5
"""That are located in one step; what follows is handled at its end, as where a state chatters."""
TOLERANCE = 1e-9
"""Share of a step to which an event is located."""


@dataclass(frozen=True, eq=False)
class Span:
    """A step. time: of its begin, s; length: s. first, last: inputs at its ends, (inputs,)."""

    time: float
    length: float
    first: Floats
    last: Floats

    def at(self, share: float) -> float:
        """Return the time after a share of the step, s."""
        return self.time + share * self.length

    def inputs(self, share: float) -> Floats:
        """Return the inputs after a share of the step."""
        return self.first + share * (self.last - self.first)


class Step:
    """One step of one run."""

    def __init__(
        self, instance: Instance, states: ContinuousStates, span: Span, loop: Derivatives | None
    ) -> None:
        """loop: what acts on derivatives; None: nothing."""
        self._instance, self._states, self._span, self._loop = instance, states, span, loop

    def advance(self) -> bool:
        """Integrate the step and handle its events; tell whether the FMU ended."""
        begin, states = 0.0, self._states
        for count in range(MOST_EVENTS + 1):
            x, slope = self._integrate(begin)
            event = self._due() < 1.0 + TOLERANCE or states.crossed()
            if not event or count == MOST_EVENTS:
                return states.completed(event)
            begin = self._locate(begin, x, slope)
            if states.completed(event=True):
                return True
            if begin >= 1.0 - TOLERANCE:
                break
        return False

    def _due(self) -> float:
        """Return the share of the step after which the FMU announced an event."""
        return (self._states.next_event - self._span.time) / self._span.length

    def _integrate(self, begin: float) -> tuple[Floats, Floats]:
        """Integrate from a share of the step to its end; return states and derivatives at its begin."""
        x, length = self._states.get(), (1.0 - begin) * self._span.length
        slopes: list[Floats] = []
        total = np.zeros_like(x)
        for number, (part, weight) in enumerate(STAGES):
            there = x + part * length * slopes[-1] if slopes else x
            slopes.append(self._slope(begin + part * (1.0 - begin), there, number, begin == 0.0))
            total = total + weight * slopes[-1]
        if self._loop is not None and begin == 0.0:
            self._loop.end()
        self._put(1.0, x + length / 6.0 * total)
        return x, slopes[0]

    def _slope(self, share: float, x: Floats, number: int, whole: bool) -> Floats:
        """Return derivatives with what acts on them. whole: at a stage of the whole step."""
        self._put(share, x)
        slopes, inputs = self._states.rates(), self._span.inputs(share)
        if self._loop is None:
            return slopes
        if whole:
            return self._loop.acted(slopes, x, inputs, number)
        return self._loop.once(slopes, x, inputs, share)

    def _put(self, share: float, x: Floats, time: float | None = None) -> None:
        """Set inputs, time and states. time: exactly; None: that of the share."""
        span = self._span
        self._instance.set(self._instance.continuous, span.inputs(share))
        self._states.put(span.at(share) if time is None else time, x)

    def _locate(self, begin: float, x: Floats, slope: Floats) -> float:
        """Go to the first event after a share of the step; return its share.

        x, slope: states and derivatives at the begin; the FMU is at the end of the step.
        """
        last = self._states.get()
        curve = Cubic(
            begin, self._span.length, (x, last), (slope, self._slope(1.0, last, 0, whole=False))
        )
        low, high = begin, min(max(self._due(), begin), 1.0)
        announced = self._states.next_event if self._due() < 1.0 + TOLERANCE else None
        self._put(high, curve.at(high), announced)
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
    """States from a share of a step to its end. x, slopes: at both ends; length: of the step, s."""

    begin: float
    length: float
    x: tuple[Floats, Floats]
    slopes: tuple[Floats, Floats]

    def at(self, share: float) -> Floats:
        """Return the states after a share of the step."""
        part = 1.0 - self.begin
        s, scale = (share - self.begin) / part, part * self.length
        (first, last), (k, m) = self.x, self.slopes
        told = (1.0 - s) * first + s * last
        bent = (1.0 - 2.0 * s) * (last - first) + scale * ((s - 1.0) * k + s * m)
        return np.asarray(told + s * (s - 1.0) * bent)
