"""The continuous states of an FMU for model exchange, and its events."""

import ctypes
import math
from collections.abc import Callable

import numpy as np

from slipbench.identification.mismatch.callables.call import CallFailedError
from slipbench.identification.mismatch.callables.fmu.instance import Instance
from slipbench.plant.signals import Floats

DOUBLES = ctypes.POINTER(ctypes.c_double)
MOST_ITERATIONS = 100
"""Of the discrete states at one event."""


class _Doubles:
    """An array of FMI, and the pointer to it, which costs more than a call if made anew for each."""

    def __init__(self, size: int) -> None:
        """size: numbers."""
        self.array: Floats = np.zeros(size)
        self._pointer = self.array.ctypes.data_as(DOUBLES)

    def call(self, function: Callable[..., object]) -> None:
        """Call a function of an FMU that reads or writes the array."""
        if self.array.size:
            function(self._pointer, self.array.size)


class ContinuousStates:
    """States, rates and event indicators of an instance; arrays are those of FMI."""

    def __init__(self, instance: Instance) -> None:
        """Count states and indicators of an initialized instance."""
        self._fmu, self._version = instance.fmu, instance.plan.fmu.version
        description = instance.plan.fmu.description
        if self._version == "2.0":
            states, indicators = len(description.derivatives), description.numberOfEventIndicators
        else:
            states = self._fmu.getNumberOfContinuousStates()
            indicators = self._fmu.getNumberOfEventIndicators()
        self._x, self._dx, self._z = (_Doubles(n) for n in (states, states, int(indicators)))
        self._signs = self._z.array > 0.0
        self._next = math.inf
        name = "getDerivatives" if self._version == "2.0" else "getContinuousStateDerivatives"
        self._derivatives = getattr(self._fmu, name)

    def get(self) -> Floats:
        """Return the states, a new array."""
        self._x.call(self._fmu.getContinuousStates)
        return self._x.array.copy()

    def put(self, time: float, x: Floats) -> None:
        """Set time and states."""
        self._fmu.setTime(time)
        self._x.array[:] = x
        self._x.call(self._fmu.setContinuousStates)

    def rates(self) -> Floats:
        """Return the rates of the states, a new array."""
        self._dx.call(self._derivatives)
        return self._dx.array.copy()

    def ended(self, time: float) -> bool:
        """Complete a step and handle what happened in it; tell whether the FMU ended."""
        event, terminate = self._fmu.completedIntegratorStep()
        if event or time >= self._next or self._crossed():
            self._fmu.enterEventMode()
            return bool(terminate) or self.handle_event()
        return bool(terminate)

    def handle_event(self) -> bool:
        """Iterate discrete states and go on in continuous time; tell whether the FMU ended."""
        name = "newDiscreteStates" if self._version == "2.0" else "updateDiscreteStates"
        for _ in range(MOST_ITERATIONS):
            more, terminate, _, _, timed, time = getattr(self._fmu, name)()
            if terminate:
                return True
            if not more:
                self._next = float(time) if timed else math.inf
                self._fmu.enterContinuousTimeMode()
                self._crossed()
                return False
        raise CallFailedError(f"its discrete states do not settle in {MOST_ITERATIONS} iterations")

    def _crossed(self) -> bool:
        """Read the indicators; tell whether one has another sign than before."""
        if not self._z.array.size:
            return False
        self._z.call(self._fmu.getEventIndicators)
        before, self._signs = self._signs, self._z.array > 0.0
        return bool((before != self._signs).any())
