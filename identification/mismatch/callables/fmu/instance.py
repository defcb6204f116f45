"""One instance of an FMU at a time, with one interface for FMI 2.0 and 3.0.

Log messages of the FMU are stored: the last ones give the reason of a failure. Arrays are allocated
once and reused, since a run makes tens of thousands of calls to fmpy.
"""

import ctypes
from abc import ABC, abstractmethod
from collections import deque
from typing import Any

import numpy as np

from slipbench.identification.mismatch.callables.call import CallFailedError
from slipbench.identification.mismatch.callables.fmu.plan import Plan
from slipbench.identification.mismatch.callables.fmu.values import Group, Values
from slipbench.plant.signals import Floats
from slipbench.protocol.extras import optional_library

WARNING = 1  # FMI status: lowest that is stored
MOST_WORDS = 3
DISCARD = 2  # FMI 2.0 status: a step was not completed
LAST_TIME, ENDED = 2, 3  # of fmi2StatusKind


class Doubles:
    """Numbers that are set or read together: as a C array for FMI, and as a numpy view of it."""

    def __init__(self, count: int) -> None:
        """count: number of elements."""
        self.count = count
        self.values = (ctypes.c_double * count)()
        self.array: Floats = np.ctypeslib.as_array(self.values)


class Instance(ABC):
    """An FMU that is instantiated for each run."""

    def __init__(self, plan: Plan) -> None:
        """Load the library. Raises CallFailedError."""
        self.plan = plan
        self.words: deque[str] = deque(maxlen=MOST_WORDS)
        try:
            self.fmu = self._load()
        except Exception as fault:  # fmpy raises plain exceptions
            why = f"its library cannot be loaded: {fault}{plan.absent_tool}"
            raise CallFailedError(why) from fault
        self.parameters, self.inputs, self.outputs = (
            Values(ports) for ports in (plan.parameters, plan.inputs, plan.outputs)
        )
        self.continuous, self.discrete = (Values(plan.inputs, which) for which in (False, True))

    def begin(self, parameters: Floats, inputs: Floats, stop: float) -> None:
        """Instantiate and initialize. parameters, inputs: units of the FMU.

        stop: later than all steps, s: some FMUs reject a step that exceeds it by rounding.
        """
        self.words.clear()
        self._instantiate_or_fail()
        self._set_up(stop)
        self.set(self.parameters, parameters)
        self._enter_initialization(stop)
        self.set(self.inputs, inputs)
        self.fmu.exitInitializationMode()

    def end(self) -> None:
        """Free the instance; the library stays loaded."""
        if self.fmu.component:
            self._free()
            self.fmu.component = None

    def set(self, which: Values, values: Floats) -> None:
        """Set variables. values: units of the FMU; integer types are rounded."""
        for group in which.groups:
            group.put(values)
            self._set(group)

    def get(self, which: Values) -> Floats:
        """Return variables, a new array, in units of the FMU."""
        found = np.empty(which.count)
        for group in which.groups:
            self._get(group)
            group.take(found)
        return found

    def step(self, time: float, step: float) -> None:
        """Advance by one communication step, s. Raises CallFailedError where the FMU terminates."""
        end_time = self._do_step(time, step)
        if end_time is not None:
            raise CallFailedError(f"the FMU ended the simulation at {end_time:.6g} s")

    def reason(self, fault: Exception) -> str:
        """Return why a call failed: the error of fmpy and the last messages of the FMU."""
        text = "; ".join(self.words)
        return f"{fault}" + (f" The FMU says: {text}" if text else "")

    def keep(self, status: int, message: bytes | None) -> None:
        """Store a message of the FMU."""
        if status >= WARNING and message:
            self.words.append(message.decode("utf-8", "replace").strip())

    def _instantiate_or_fail(self) -> None:
        """Instantiate; on failure, repeat with logging enabled to obtain the reason."""
        for log in (False, True):
            try:
                return self._instantiate(log)
            except Exception as fault:
                if log:
                    text = f"it cannot be instantiated (no licence?).{self.plan.absent_tool}"
                    raise CallFailedError(self.reason(Exception(text))) from fault
        return None

    @abstractmethod
    def _load(self) -> Any:
        """Return fmpy's object of the library."""

    @abstractmethod
    def _instantiate(self, log: bool) -> None:
        """Instantiate."""

    def _set_up(self, stop: float) -> None:
        """Set up the experiment before parameters are set."""
        return

    @abstractmethod
    def _enter_initialization(self, stop: float) -> None:
        """Enter initialization mode."""

    @abstractmethod
    def _do_step(self, time: float, step: float) -> float | None:
        """Do a co-simulation step; return when the FMU terminated, s, or None."""

    @abstractmethod
    def _set(self, group: Group) -> None:
        """Set variables of one type from their array."""

    @abstractmethod
    def _get(self, group: Group) -> None:
        """Read variables of one type into their array."""

    @abstractmethod
    def _free(self) -> None:
        """Free the instance."""


class Instance2(Instance):
    """FMI 2.0, either interface."""

    def _load(self) -> Any:
        fmi2 = optional_library("fmpy.fmi2")
        kind = "FMU2Slave" if self.plan.interface == "co_simulation" else "FMU2Model"
        self._callbacks = self._callback_functions(fmi2)
        return getattr(fmi2, kind)(**self.plan.loading())

    def _callback_functions(self, fmi2: Any) -> Any:
        base, logging = optional_library("fmpy"), optional_library("fmpy.logging")

        def log(_: Any, __: Any, status: int, ___: Any, message: bytes) -> None:
            self.keep(status, message)

        found = fmi2.fmi2CallbackFunctions()
        found.logger = fmi2.fmi2CallbackLoggerTYPE(log)
        found.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(base.calloc)
        found.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(base.free)
        logging.addLoggerProxy(ctypes.byref(found))
        return found

    def _instantiate(self, log: bool) -> None:
        self.fmu.instantiate(callbacks=self._callbacks, loggingOn=log)

    def _set_up(self, stop: float) -> None:
        self.fmu.setupExperiment(startTime=0.0, stopTime=stop)

    def _enter_initialization(self, stop: float) -> None:
        self.fmu.enterInitializationMode()

    def _do_step(self, time: float, step: float) -> float | None:
        try:
            self.fmu.doStep(time, step)
        except Exception as fault:  # fmpy's own, for a call that failed
            if getattr(fault, "status", None) != DISCARD or not self.fmu.getBooleanStatus(ENDED):
                raise
            return float(self.fmu.getRealStatus(LAST_TIME))
        return None

    def _set(self, group: Group) -> None:
        function = getattr(self.fmu, f"fmi2Set{group.name}")
        function(self.fmu.component, group.references, group.variables, group.values)

    def _get(self, group: Group) -> None:
        function = getattr(self.fmu, f"fmi2Get{group.name}")
        function(self.fmu.component, group.references, group.variables, group.values)

    def _free(self) -> None:
        self.fmu.fmi2FreeInstance(self.fmu.component)


class Instance3(Instance):
    """FMI 3.0, either interface."""

    def _load(self) -> Any:
        fmi3 = optional_library("fmpy.fmi3")
        kind = "FMU3Slave" if self.plan.interface == "co_simulation" else "FMU3Model"
        return getattr(fmi3, kind)(**self.plan.loading())

    def _instantiate(self, log: bool) -> None:
        def log_message(_: Any, status: int, __: Any, message: bytes) -> None:
            self.keep(status, message)

        self.fmu.instantiate(loggingOn=log, logMessage=log_message)

    def _enter_initialization(self, stop: float) -> None:
        self.fmu.enterInitializationMode(startTime=0.0, stopTime=stop)

    def _do_step(self, time: float, step: float) -> float | None:
        returned = self.fmu.doStep(time, step)
        return float(returned[3]) if returned is not None and (returned[1] or returned[2]) else None

    def _set(self, group: Group) -> None:
        self._call(f"fmi3Set{group.name}", group)

    def _get(self, group: Group) -> None:
        self._call(f"fmi3Get{group.name}", group)

    def _call(self, name: str, g: Group) -> None:
        function = getattr(self.fmu, name)
        function(self.fmu.component, g.references, g.variables, g.values, g.count)

    def _free(self) -> None:
        self.fmu.fmi3FreeInstance(self.fmu.component)


def instance_of(plan: Plan) -> Instance:
    """Load an FMU. Raises CallFailedError."""
    return (Instance2 if plan.fmu.version == "2.0" else Instance3)(plan)
