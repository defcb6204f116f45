"""A run of an FMU for model exchange: its states integrated by the classical Runge-Kutta rule.

The step is fixed. An event (a sign change of an indicator, a time that the FMU announced, or one that
it asks for) is handled at the end of the step in which it lies: choose the step accordingly.
"""

import math

import numpy as np

from slipbench.identification.mismatch.callables.acting_rates import ActingRates
from slipbench.identification.mismatch.callables.call import CallFailedError
from slipbench.identification.mismatch.callables.fmu.derivatives import STAGES, Derivatives
from slipbench.identification.mismatch.callables.fmu.instance import Instance
from slipbench.identification.mismatch.callables.fmu.states import ContinuousStates
from slipbench.plant.signals import Floats


def integrated(
    instance: Instance,
    parameters: Floats,
    inputs: Floats,
    times: Floats,
    acting: ActingRates | None = None,
) -> Floats:
    """Return outputs at all times, (n, outputs). inputs: (n, inputs), units of the FMU.

    acting: on derivatives. Raises CallFailedError where the FMU ends the simulation.
    """
    step = float(times[1] - times[0])
    parts = max(1, math.ceil(step / instance.plan.step - 1e-9))
    held = np.array(instance.plan.held)
    found = np.empty((times.size, instance.outputs.count))
    instance.begin(parameters, inputs[0], float(times[-1]))
    states = ContinuousStates(instance)
    states.handle_event()
    loop = None if acting is None else Derivatives(instance.plan, acting, step / parts)
    found[0] = instance.get(instance.outputs)
    for row in range(times.size - 1):
        first, last = inputs[row], np.where(held, inputs[row], inputs[row + 1])
        for part in range(parts):
            ends = [first + (part + k) / parts * (last - first) for k in (0, 1)]
            if loop is not None:
                loop.begin(row, part, row * parts + part)
            time = float(times[row]) + step * part / parts
            _step(instance, states, time, step / parts, ends, loop)
        if loop is not None:
            loop.end_row(states.rates(), states.get(), last)
        found[row + 1] = instance.get(instance.outputs)
    return found


def _step(
    instance: Instance,
    states: ContinuousStates,
    time: float,
    step: float,
    ends: list[Floats],
    loop: Derivatives | None,
) -> None:
    """Integrate one step and handle its events. ends: inputs when it begins and ends."""
    x = states.get()
    slope, total = np.zeros_like(x), np.zeros_like(x)
    for number, (share, weight) in enumerate(STAGES):
        u, there = ends[0] + share * (ends[1] - ends[0]), x + share * step * slope
        instance.set(instance.inputs, u)
        states.put(time + share * step, there)
        slope = states.rates()
        if loop is not None:
            slope = loop.acted(slope, there, u, number)
        total = total + weight * slope
    if loop is not None:
        loop.end()
    instance.set(instance.inputs, ends[1])
    states.put(time + step, x + step / 6.0 * total)
    if states.ended(time + step):
        raise CallFailedError(f"the FMU ended the simulation at {time + step:.6g} s")
