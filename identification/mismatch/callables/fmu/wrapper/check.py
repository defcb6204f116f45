"""A wrapper compared with the simulation of `slipbench explain` for the same FMU and effects."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from slipbench.identification.mismatch.callables.call import Call, CallFailedError
from slipbench.identification.mismatch.callables.description import bounds
from slipbench.identification.mismatch.callables.fmu.fmu_system import OpenFmu
from slipbench.identification.mismatch.callables.fmu.plan import Plan
from slipbench.identification.mismatch.callables.fmu.runner import FmuRunner
from slipbench.identification.mismatch.callables.fmu.unpacked import unpacked
from slipbench.identification.mismatch.callables.fmu.wrapper.sides import Sides
from slipbench.identification.mismatch.callables.simulator import ExternalSimulator
from slipbench.identification.mismatch.callables.worker import CAN_ISOLATE, IsolatedCaller
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sampling import Grid
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.identification.mismatch.systems.simulator import Task
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError

STEPS, LEVEL = 300, 15
"""Number of communication steps, and for how many of them an input is constant."""
SHARE = 0.5
"""Half range of the input levels around the start value, relative to the usual magnitude."""


def largest_deviation(path: Path, sides: Sides, seed: int = 0) -> float:
    """Simulate steps of all inputs with a wrapper and with the simulator of `explain`.

    path: of the wrapper. Returns the largest difference of an output, relative to its largest
    value. Raises InputError where one of them does not run.
    """
    file = held(sides.opened.model)
    inputs = levels(sides, np.random.default_rng(seed))
    expected = explained(sides, file, inputs)
    found = simulated_by_wrapper(path, sides.opened, inputs)
    return max(
        float(np.max(np.abs(found[name] - values)) / max(np.max(np.abs(values)), 1e-300))
        for name, values in expected.items()
    )


def held(file: ModelFile) -> ModelFile:
    """Return the file with inputs that are held over a step, as those of an FMU."""
    inputs = {
        name: one.model_copy(update={"held": True, "smooth": False})
        for name, one in file.inputs.items()
    }
    return file.model_copy(update={"inputs": inputs})


def levels(sides: Sides, rng: np.random.Generator) -> dict[str, Floats]:
    """Return all inputs by name, SI, (steps,): random levels around their start values."""
    plan, file = sides.opened.plan, sides.opened.model
    found = {}
    for port, entry in zip(plan.inputs, file.inputs.values(), strict=True):
        half_range = 0.0 if getattr(entry, "exact", False) else SHARE * abs(entry.size.si)
        around = rng.uniform(-1.0, 1.0, STEPS // LEVEL)
        found[port.name] = port.start + half_range * np.repeat(around, LEVEL)
    return found


def explained(sides: Sides, file: ModelFile, inputs: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return the outputs simulated by `explain`, SI, shape (steps,) each.

    inputs: SI, shape (steps,) each. Raises InputError where the FMU does not run with them.
    """
    opened = sides.opened
    plan = replace(opened.plan, held=(True,) * len(inputs))
    simulator = ExternalSimulator(
        _caller(plan, opened), *bounds(opened.parameters, file), "the FMU"
    )
    columns = np.reshape(list(inputs.values()), (-1, STEPS)).T
    grid = Grid(STEPS, 0.0, STEPS, file.step, file.step)
    record = Record("the check", 0.0, grid, columns, {}, {}, np.zeros((STEPS, 0)))
    point_count = len(file.inputs) + len(file.states) + len(file.outputs)
    no_disturbance = np.zeros((STEPS, point_count))
    task = Task(file, opened.system.values, sides.acting, record, no_disturbance)
    try:
        result = simulator.run(task)
    except PlantError as fault:
        raise InputError(
            "the FMU does not run with steps of its inputs",
            where=str(opened.beside),
            found=str(fault),
            remedy="correct the usual magnitudes of its inputs, or take a smaller step",
        ) from fault
    return {name: result[name] for name in file.outputs}


def simulated_by_wrapper(
    path: Path, opened: OpenFmu, inputs: Mapping[str, Floats]
) -> dict[str, Floats]:
    """Return the outputs of a wrapper, SI, (steps,). Raises InputError where it does not run."""
    outputs = opened.plan.outputs[: len(opened.model.outputs)]
    step = opened.model.step
    plan = Plan(
        unpacked(path),
        "co_simulation",
        step,
        (),
        opened.plan.inputs,
        outputs,
        (True,) * len(inputs),
    )
    times = np.asarray(step * np.arange(STEPS + 1), np.float64)
    columns = {name: np.append(values, values[-1]) for name, values in inputs.items()}
    try:
        found = _caller(plan, opened)(Call({}, columns, times, tuple(opened.model.outputs)))
    except CallFailedError as fault:
        raise InputError("the wrapper does not run", where=str(path), found=str(fault)) from fault
    return {name: values[1:] for name, values in found.items()}


def _caller(plan: Plan, opened: OpenFmu) -> FmuRunner | IsolatedCaller:
    runner = FmuRunner(plan)
    return IsolatedCaller(runner, opened.time_limit) if CAN_ISOLATE else runner
