"""An external simulation as the simulator of a system.

Effects act on its inputs and outputs (operators.py). Results of runs are cached: effects at outputs
or in sensors alone require no new run.
"""

import time
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from hashlib import blake2b
from threading import Lock

import numpy as np

from slipbench.identification.mismatch.callables.call import (
    Call,
    Caller,
    CallFailedError,
    difference,
)
from slipbench.identification.mismatch.callables.operators import (
    acting_rates,
    inputs_with_effects,
    outputs_with_effects,
    shown_names,
    speeds_used,
)
from slipbench.identification.mismatch.systems.model_file import ModelFile, Number
from slipbench.identification.mismatch.systems.run import BOUND, SimulatedColumns
from slipbench.identification.mismatch.systems.simulator import Simulator, Task
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError
from slipbench.protocol.units import to_base

PASSES = 3
"""Runs where the regressor of an effect at an input is an output: the recorded output in the first
run, then the output of the previous run."""
RUNS = (150, 2000)
"""Runs per recording: without mismatch, and with many competing effects."""
MOST_KEPT = 64_000_000
"""Size limit of the cached runs, bytes."""


@dataclass
class RunCache:
    """Cached runs by call, the oldest first.

    made: number of runs; repeatable: whether repeatability was verified; seconds: time of one run.
    """

    runs: OrderedDict[bytes, Floats] = field(default_factory=OrderedDict)
    size: int = 0
    made: int = 0
    repeatable: bool = False
    seconds: float = 0.0
    lock: Lock = field(default_factory=Lock)

    def put(self, key: bytes, run: Floats) -> None:
        """Cache a run and remove the oldest ones above the size limit.

        run: outputs and states before effects, shape (rows, outputs and states), SI.
        """
        with self.lock:
            replaced = self.runs.pop(key, None)
            self.runs[key] = run
            self.size += run.nbytes - (0 if replaced is None else replaced.nbytes)
            self.made += 1
            while self.size > MOST_KEPT and len(self.runs) > 1:
                self.size -= self.runs.popitem(last=False)[1].nbytes


@dataclass(frozen=True, eq=False)
class ExternalSimulator(Simulator):
    """Runs a black-box simulation.

    caller: runs one call. low, high: bounds of the parameters, SI, (parameters,). what: name of the
    simulation in messages.
    """

    caller: Caller
    low: Floats
    high: Floats
    what: str
    kept: RunCache = field(default_factory=RunCache)

    remedy = "run it by itself with the nominal parameters and these inputs"

    def bounded(self, values: Floats) -> Floats:
        """Return parameters within their bounds, SI, shape (parameters,)."""
        return np.clip(values, self.low, self.high)

    def duration(self, recordings: int) -> str:
        """Return the estimated duration of an analysis as text, from the first run."""
        low, high = (recordings * runs * self.kept.seconds / 60.0 for runs in RUNS)
        return (
            f"One run of {self.what} takes {self.kept.seconds:.2g} s: its runs alone take"
            f" {low:.2g} to {high:.2g} min"
        )

    def run(self, task: Task) -> SimulatedColumns:
        """Run a task, effects included. Raises PlantError where the simulation fails."""
        raw = recorded_outputs(task)
        for _ in range(PASSES if speeds_used(task) else 1):
            inputs = inputs_with_effects(task, raw)
            raw = self._outputs_before_effects(task, inputs)
        outputs = outputs_with_effects(task, inputs, raw)
        states = raw[:, len(task.file.outputs) :]
        names = (*task.file.inputs, *shown_names(task.file))
        columns = np.concatenate((inputs, outputs, states), axis=1).T
        return SimulatedColumns(dict(zip(names, columns, strict=True)))

    def first_run(self, task: Task) -> SimulatedColumns:
        """Run a task; run the first one twice. Raises InputError where results differ."""
        if not self.kept.repeatable:
            self._check_repeatable(task)
        self.kept.repeatable = True
        return self.run(task)

    def _check_repeatable(self, task: Task) -> None:
        call = call_of(task, inputs_with_effects(task, recorded_outputs(task)))
        one = self._outputs(task, call)
        begun = time.perf_counter()
        other = self._outputs(task, call)
        self.kept.seconds = time.perf_counter() - begun
        if mismatch := difference(one, other):
            raise InputError(
                "two runs with the same parameters and inputs gave different results",
                where=task.file.name,
                expected="a simulation that depends on its arguments alone",
                found=f"{mismatch} on {task.record.name}",
                remedy="fix the seed of random numbers, and keep no state between two runs",
            )

    def _outputs_before_effects(self, task: Task, inputs: Floats) -> Floats:
        """Return the simulated outputs and states before effects, (rows, outputs and states)."""
        call = call_of(task, inputs)
        key = _key(call)
        if (run := self.kept.runs.get(key)) is None:
            entries = self._outputs(task, call)
            run = np.column_stack([entries[name][1:] for name in call.outputs])
            _check_bounded(task, run)
            self.kept.put(key, run)
        return run

    def _outputs(self, task: Task, call: Call) -> Mapping[str, Floats]:
        try:
            return self.caller(call)
        except CallFailedError as fault:
            if fault.lost:
                raise InputError(str(fault), where=task.file.name, remedy=self.remedy) from fault
            raise PlantError(
                "the simulation failed",
                f"{task.file.name} on {task.record.name}",
                "finite outputs",
                f"{fault} at {_in_words(call.parameters)}",
                "other parameters are tried",
            ) from fault


def recorded_outputs(task: Task) -> Floats:
    """Return the recorded outputs and states, SI; 0 where not recorded.

    Shape (rows, outputs and states).
    """
    zeros = np.zeros(task.record.grid.rows)
    known = task.record.measured
    return np.column_stack([known.get(name, zeros) for name in shown_names(task.file)])


def call_of(task: Task, inputs: Floats) -> Call:
    """Return the call of a task; sample k of all arrays is at times[k].

    inputs: SI, shape (rows, inputs); a row begins at a sample and ends at the next one.
    """
    grid = task.record.grid
    entries = zip(task.file.inputs.items(), inputs.T, strict=True)
    columns = {
        name: np.append(column, column[-1]) if one.steps else np.insert(column, 0, column[0])
        for (name, one), column in entries
    }
    times = np.asarray(grid.step * np.arange(grid.rows + 1), np.float64)
    parameters = written(task.file, task.values)
    return Call(parameters, columns, times, shown_names(task.file), acting_rates(task))


def _check_bounded(task: Task, run: Floats) -> None:
    """Raise PlantError where a run, (rows, outputs and states), grows without bound."""
    sizes: dict[str, Number] = {name: one.size for name, one in task.file.outputs.items()}
    sizes |= {name: one.size for name, one in task.file.states.items()}
    for (name, size), column in zip(sizes.items(), run.T, strict=True):
        largest = float(np.max(np.abs(column), initial=0.0))
        if largest > BOUND * abs(size.si):
            raise PlantError(
                "the simulation grows without bound",
                f"{task.file.name} on {task.record.name}",
                f"{name} within {BOUND:g} times its size, {size.value:g} {size.unit}",
                f"{largest:.3g} {size.si_unit}",
                "take a smaller step, or the other interface of an FMU; or correct the size",
            )


def written(file: ModelFile, values: Floats) -> dict[str, float]:
    """Return parameters in the units of the file. values: SI, in the file's order."""
    numbers = zip(file.parameters.items(), values, strict=True)
    return {name: _in_unit(number, float(value)) for (name, number), value in numbers}


def _in_unit(number: Number, value: float) -> float:
    slope, offset, _ = to_base(number.unit)
    return (value - offset) / slope


def _key(call: Call) -> bytes:
    numbers = np.array(list(call.parameters.values()), np.float64)
    acting = () if call.rates is None else call.rates.arrays
    arrays = (numbers, call.times[[1, -1]], *call.inputs.values(), *acting)
    return blake2b(b"".join(a.tobytes() for a in arrays), digest_size=20).digest()


def _in_words(parameters: Mapping[str, float]) -> str:
    return (
        ", ".join(f"{name} = {value:.6g}" for name, value in parameters.items()) or "no parameter"
    )
