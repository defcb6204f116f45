"""The continuous states of an FMU for model exchange, and its events."""

import math
from collections.abc import Callable

from slipbench.identification.mismatch.callables.call import CallFailedError
from slipbench.identification.mismatch.callables.fmu.instance import Doubles, Instance
from slipbench.plant.signals import Floats

MOST_ITERATIONS = 100
"""Limit of the iterations of discrete states at one event."""


class ContinuousStates:
    """Continuous states, rates and event indicators of an instance, with the arrays for FMI."""

    def __init__(self, instance: Instance) -> None:
        """Allocate arrays for the states and indicators of an initialized instance."""
        self._fmu, self._version = instance.fmu, instance.plan.fmu.version
        description = instance.plan.fmu.description
        if self._version == "2.0":
            states, indicators = len(description.derivatives), description.numberOfEventIndicators
        else:
            states = self._fmu.getNumberOfContinuousStates()
            indicators = self._fmu.getNumberOfEventIndicators()
        self._x, self._dx, self._z = (Doubles(n) for n in (states, states, int(indicators)))
        self._signs = self._z.array > 0.0
        self._next_event_time = math.inf
        name = "getDerivatives" if self._version == "2.0" else "getContinuousStateDerivatives"
        self._derivatives = getattr(self._fmu, name)

    def get(self) -> Floats:
        """Return the states, a new array of shape (states,), in units of the FMU."""
        _call(self._x, self._fmu.getContinuousStates)
        return self._x.array.copy()

    def put(self, time: float, x: Floats) -> None:
        """Set time, s, and states, shape (states,), in units of the FMU."""
        self._fmu.setTime(time)
        self._x.array[:] = x
        _call(self._x, self._fmu.setContinuousStates)

    def rates(self) -> Floats:
        """Return the rates of the states, a new array of shape (states,), in units of the FMU."""
        _call(self._dx, self._derivatives)
        return self._dx.array.copy()

    @property
    def next_event(self) -> float:
        """Time of the next time event, s; infinity where there is none."""
        return self._next_event_time

    def crossed(self) -> bool:
        """Return whether an event indicator has changed sign since the last event."""
        if not self._z.count:
            return False
        _call(self._z, self._fmu.getEventIndicators)
        return bool((self._signs != (self._z.array > 0.0)).any())

    def completed(self, event: bool) -> bool:
        """Complete a step and handle an event at its end; return whether the FMU terminated.

        event: whether there is an event at the end of the step.
        """
        needed, terminate = self._fmu.completedIntegratorStep()
        if needed or event:
            self._fmu.enterEventMode()
            return bool(terminate) or self.handle_event()
        return bool(terminate)

    def enter_event(self) -> None:
        """Enter event mode, in which discrete inputs may be set."""
        self._fmu.enterEventMode()

    def handle_event(self) -> bool:
        """Iterate discrete states and enter continuous time; return whether the FMU terminated.

        Raises CallFailedError where the discrete states do not settle in MOST_ITERATIONS
        iterations.
        """
        name = "newDiscreteStates" if self._version == "2.0" else "updateDiscreteStates"
        for _ in range(MOST_ITERATIONS):
            more, terminate, _, _, timed, time = getattr(self._fmu, name)()
            if terminate:
                return True
            if not more:
                self._next_event_time = float(time) if timed else math.inf
                self._fmu.enterContinuousTimeMode()
                self._store_signs()
                return False
        raise CallFailedError(f"its discrete states do not settle in {MOST_ITERATIONS} iterations")

    def _store_signs(self) -> None:
        _call(self._z, self._fmu.getEventIndicators)
        self._signs = self._z.array > 0.0


def _call(numbers: Doubles, function: Callable[..., object]) -> None:
    """Call a function of an FMU that reads or writes numbers."""
    if numbers.count:
        function(numbers.values, numbers.count)
