"""A run of an FMU for co-simulation: from one communication point to the next.

A held input is set before the step. One that follows a straight line is set to its mean over the
step, and to its end before outputs are read: so neither comes half a step late.
"""

import math

import numpy as np

from slipbench.identification.mismatch.callables.acting_rates import ActingRates
from slipbench.identification.mismatch.callables.call import CallFailedError
from slipbench.identification.mismatch.callables.fmu.instance import Instance
from slipbench.plant.signals import Floats


def co_simulated(
    instance: Instance,
    parameters: Floats,
    inputs: Floats,
    times: Floats,
    acting: ActingRates | None = None,
) -> Floats:
    """Return outputs at all times, (n, outputs). inputs: (n, inputs), units of the FMU.

    acting: None, since derivatives are inside of the FMU. Raises CallFailedError where the FMU ends
    the simulation.
    """
    assert acting is None
    step = float(times[1] - times[0])
    parts = max(1, math.ceil(step / instance.plan.step - 1e-9))
    _check_step(instance, step / parts)
    held = np.array(instance.plan.held, bool)
    subsystems = driving(inputs, held, parts)
    found = np.empty((times.size, instance.outputs.count))
    instance.begin(parameters, inputs[0], float(times[-1]) + step)
    found[0] = instance.get(instance.outputs)
    for row in range(times.size - 1):
        for part in range(parts):
            instance.set(instance.inputs, subsystems[row * parts + part])
            instance.step(step * (row + part / parts), step / parts)
        if not held.all():
            instance.set(instance.inputs, np.where(held, inputs[row], inputs[row + 1]))
        found[row + 1] = instance.get(instance.outputs)
    return found


def driving(inputs: Floats, held: np.ndarray[tuple[int], np.dtype[np.bool_]], parts: int) -> Floats:
    """Return what each step is driven by, (steps, inputs)."""
    level = np.repeat(inputs[:-1], parts, axis=0)
    share = np.tile((np.arange(parts) + 0.5) / parts, len(inputs) - 1)[:, None]
    return np.where(held, level, level + share * np.repeat(np.diff(inputs, axis=0), parts, axis=0))


def _check_step(instance: Instance, step: float) -> None:
    """Raise CallFailedError where the solver of the FMU has longer steps than communication."""
    told = getattr(instance.plan.fmu.description.coSimulation, "fixedInternalStepSize", None)
    own = float(told or 0.0)
    if step < own * (1.0 - 1e-6):
        raise CallFailedError(
            f"its own solver takes steps of {own:g} s, longer than those of communication, {step:g} s:"
            ' its outputs would stand still between them; interface = "model_exchange" has no such'
            " step, where the FMU offers it"
        )
