"""A run of an FMU for model exchange: its states integrated by the classical Runge-Kutta rule.

The step is fixed and is split at events (steps.py). Discrete inputs, for example a switch, are set
in event mode at the beginning of a row.
"""

import math

import numpy as np

from slipbench.identification.mismatch.callables.acting_rates import ActingRates
from slipbench.identification.mismatch.callables.call import CallFailedError
from slipbench.identification.mismatch.callables.fmu.derivatives import Derivatives
from slipbench.identification.mismatch.callables.fmu.instance import Instance
from slipbench.identification.mismatch.callables.fmu.states import ContinuousStates
from slipbench.identification.mismatch.callables.fmu.steps import Span, Step
from slipbench.plant.signals import Floats


def integrated(
    instance: Instance,
    parameters: Floats,
    inputs: Floats,
    times: Floats,
    acting: ActingRates | None = None,
) -> Floats:
    """Return outputs at all times, (n, outputs). inputs: (n, inputs), units of the FMU.

    acting: disturbances and effects on derivatives. Raises CallFailedError where the FMU ends the
    simulation.
    """
    step = float(times[1] - times[0])
    parts = max(1, math.ceil(step / instance.plan.step - 1e-9))
    held = np.array(instance.plan.held, bool)
    outputs = np.empty((times.size, instance.outputs.count))
    instance.begin(parameters, inputs[0], float(times[-1]) + step)
    states = ContinuousStates(instance)
    _raise_if_terminated(states.handle_event(), 0.0)
    loop = None if acting is None else Derivatives(instance.plan, acting, step / parts)
    outputs[0] = instance.get(instance.outputs)
    for row in range(times.size - 1):
        first, last = inputs[row], np.where(held, inputs[row], inputs[row + 1])
        if row and _discrete_change(instance, inputs[row - 1], first):
            states.enter_event()
            instance.set(instance.discrete, first)
            _raise_if_terminated(states.handle_event(), float(times[row]))
        for part in range(parts):
            ends = [first + (part + k) / parts * (last - first) for k in (0, 1)]
            if loop is not None:
                loop.begin(row, part, row * parts + part)
            time = float(times[row]) + step * part / parts
            span = Span(time, step / parts, ends[0], ends[1])
            _raise_if_terminated(Step(instance, states, span, loop).advance(), span.at(1.0))
        if loop is not None:
            loop.end_row(states.rates(), states.get(), last)
        outputs[row + 1] = instance.get(instance.outputs)
    return outputs


def _discrete_change(instance: Instance, before: Floats, now: Floats) -> bool:
    """Return whether a discrete input changes."""
    return any(
        port.discrete and value_before != value_now
        for port, value_before, value_now in zip(instance.plan.inputs, before, now, strict=True)
    )


def _raise_if_terminated(terminated: bool, time: float) -> None:
    if terminated:
        raise CallFailedError(f"the FMU ended the simulation at {time:.6g} s")
