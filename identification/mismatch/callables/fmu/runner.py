"""Runs calls on an FMU. The library is loaded at the first call, in the worker process."""

import numpy as np

from slipbench.identification.mismatch.callables.call import Call, CallFailedError, checked
from slipbench.identification.mismatch.callables.fmu.co_simulation import co_simulated
from slipbench.identification.mismatch.callables.fmu.instance import Instance, instance_of
from slipbench.identification.mismatch.callables.fmu.model_exchange import integrated
from slipbench.identification.mismatch.callables.fmu.plan import Plan, from_fmu_units, to_fmu_units
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import is_interrupt

RUN = {"co_simulation": co_simulated, "model_exchange": integrated}


class FmuRunner:
    """Caller of an FMU."""

    def __init__(self, plan: Plan) -> None:
        """plan: configuration of the run."""
        self._plan = plan
        self._instance: Instance | None = None

    def __call__(self, call: Call) -> dict[str, Floats]:
        """Run a call. Raises CallFailedError."""
        self._instance = self._instance or instance_of(self._plan)
        outputs = from_fmu_units(self._plan.outputs, self._run(self._instance, call))
        return checked(outputs, call.outputs, call.times.size)

    def _run(self, instance: Instance, call: Call) -> Floats:
        plan = self._plan
        parameters = to_fmu_units(plan.parameters, call.parameters)
        try:
            run = RUN[plan.interface]
            inputs = to_fmu_units(plan.inputs, call.inputs, call.times.shape)
            with np.errstate(over="ignore", invalid="ignore"):  # `checked` rejects non-finite
                return run(instance, parameters, inputs, call.times, call.rates)
        except CallFailedError:
            raise
        except Exception as fault:  # fmpy's own, for a call that failed
            if is_interrupt(fault):
                raise
            raise CallFailedError(instance.reason(fault)) from fault
        finally:
            instance.end()
