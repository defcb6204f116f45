"""A run of an FMU for co-simulation.

A held input is set before the step. A linearly interpolated input is set to its mean over the step,
and to its final value before outputs are read: so neither is delayed by half a step.
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

    acting: None, since derivatives of the FMU are not accessible. Raises CallFailedError where the
    FMU ends the simulation.
    """
    assert acting is None
    step = float(times[1] - times[0])
    parts = max(1, math.ceil(step / instance.plan.step - 1e-9))
    _check_step(instance, step / parts)
    held = np.array(instance.plan.held, bool)
    step_inputs = driving(inputs, held, parts)
    outputs = np.empty((times.size, instance.outputs.count))
    instance.begin(parameters, inputs[0], float(times[-1]) + step)
    outputs[0] = instance.get(instance.outputs)
    for row in range(times.size - 1):
        for part in range(parts):
            instance.set(instance.inputs, step_inputs[row * parts + part])
            instance.step(step * (row + part / parts), step / parts)
        if not held.all():
            instance.set(instance.inputs, np.where(held, inputs[row], inputs[row + 1]))
        outputs[row + 1] = instance.get(instance.outputs)
    return outputs


def driving(inputs: Floats, held: np.ndarray[tuple[int], np.dtype[np.bool_]], parts: int) -> Floats:
    """Return the inputs of each communication step, shape (steps, inputs), units of the FMU.

    inputs: at all times, (n, inputs), units of the FMU; held: whether an input is held, shape
    (inputs,); the others are interpolated linearly. parts: communication steps between two times.
    """
    level = np.repeat(inputs[:-1], parts, axis=0)
    share = np.tile((np.arange(parts) + 0.5) / parts, len(inputs) - 1)[:, None]
    return np.where(held, level, level + share * np.repeat(np.diff(inputs, axis=0), parts, axis=0))


def _check_step(instance: Instance, step: float) -> None:
    """Raise CallFailedError where the solver step of the FMU exceeds the communication step."""
    stated = getattr(instance.plan.fmu.description.coSimulation, "fixedInternalStepSize", None)
    own = float(stated or 0.0)
    if step < own * (1.0 - 1e-6):
        raise CallFailedError(
            f"its own solver takes steps of {own:g} s, longer than those of communication, {step:g} s:"
            ' its outputs would stand still between them; interface = "model_exchange" has no such'
            " step, where the FMU offers it"
        )
