"""Effects at the interface of a simulation, as operators on its input and output signals.

The laws and the kernel are those of the seam effects of model files: the effects run on a system
without states whose equations pass each signal through. A held input stays constant within a row:
the output of a dynamic effect within a row is replaced by its mean, as a sampled input.
"""

import inspect
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.callables.acting_rates import ActingRates
from slipbench.identification.mismatch.systems.effects.seam_effect import (
    INPUT,
    OUTPUT,
    RATE,
    SeamEffect,
)
from slipbench.identification.mismatch.systems.equations import Equations
from slipbench.identification.mismatch.systems.expression import PREFIX
from slipbench.identification.mismatch.systems.model_file import Input, ModelFile, Output, State
from slipbench.identification.mismatch.systems.run import run, slots
from slipbench.identification.mismatch.systems.simulator import Task
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats

FINER = 8
"""Substeps per row for effects with memory."""
RAW = "simulated_"
"""Prefix of the name of a simulated output before effects."""
NO_VALUES = np.zeros(0)


def shown_names(file: ModelFile) -> tuple[str, ...]:
    """Return the names of the simulated signals: outputs, then the states of the file."""
    return (*file.outputs, *file.states)


def speeds_used(task: Task) -> bool:
    """Return whether the regressor of an effect at an input is an output or a state."""
    return any(e.place.other in shown_names(task.file) for e in at_kind(INPUT, task.effects))


def inputs_with_effects(task: Task, outputs: Floats) -> Floats:
    """Return the inputs with input disturbances and effects applied, shape (rows, inputs), SI.

    outputs: shape (rows, outputs and states), SI, regressors of some effects.
    """
    disturbed = task.record.inputs + task.push[:, : len(task.file.inputs)]
    effects = at_kind(INPUT, task.effects)
    if not effects:
        return disturbed
    parts = parts_of_row(effects)
    held = [i.steps for i in task.file.inputs.values()] + [False] * len(shown_names(task.file))
    equations, file = input_signals(task.file)
    grid = task.record.grid
    fine = replace(
        task.record,
        grid=replace(grid, rows=parts * grid.rows, step=grid.step / parts),
        inputs=_finer(np.concatenate((disturbed, outputs), axis=1), held, parts),
    )
    no_disturbance = np.zeros((parts * grid.rows, len(equations.inputs)))
    result = run(equations, file, NO_VALUES, effects, fine, no_disturbance)
    return np.column_stack(
        [_of_rows(result[n], i.steps, parts) for n, i in task.file.inputs.items()]
    )


def outputs_with_effects(task: Task, inputs: Floats, raw: Floats) -> Floats:
    """Return the outputs with effects applied, shape (rows, outputs), SI.

    inputs: after their effects, shape (rows, inputs), SI; raw: before effects, shape (rows, outputs
    and states), SI.
    """
    effects = at_kind(OUTPUT, task.effects)
    if not effects:
        return raw[:, : len(task.file.outputs)]
    through, file = output_signals(task.file)
    file = file.model_copy(update={"step": task.record.grid.step / parts_of_row(effects)})
    record = replace(task.record, inputs=np.concatenate((inputs, raw), axis=1))
    result = run(
        through, file, NO_VALUES, effects, record, np.zeros((len(raw), len(through.places)))
    )
    return np.column_stack([result[n] for n in task.file.outputs])


def acting_rates(task: Task) -> ActingRates | None:
    """Return the disturbances and effects on the state derivatives; None where there are none."""
    file, first = task.file, len(task.file.inputs)
    push = np.ascontiguousarray(task.push[:, first : first + len(file.states)])
    effects = at_kind(RATE, task.effects)
    if not push.any() and not effects:
        return None
    names = rate_signals(file)
    code, where, other, par = slots(effects, [], names, file)
    longest = max((float(getattr(e, "delay", 0.0)) for e in effects), default=0.0)
    return ActingRates(names, push, code, where, other, par, longest)


def input_signals(file: ModelFile) -> tuple[Equations, ModelFile]:
    """Return the signals used by effects at inputs, inputs first, as a system without states."""
    other_signals = {n: _interpolated_input(o) for n, o in file.outputs.items()}
    other_signals |= {n: _interpolated_input(s) for n, s in file.states.items()}
    signals = {**file.inputs, **other_signals}
    equations = Equations((), tuple(signals), (), (), (), ())
    return equations, file.model_copy(update={"inputs": signals, "states": {}})


def output_signals(file: ModelFile) -> tuple[Equations, ModelFile]:
    """Return the signals used by effects at outputs, as a system that passes outputs through."""
    simulated = {f"{RAW}{n}": _interpolated_input(o) for n, o in file.outputs.items()}
    simulated |= {n: _interpolated_input(s) for n, s in file.states.items()}
    signals = {**file.inputs, **simulated}
    output_equations = tuple((n, f"{PREFIX}{RAW}{n}") for n in file.outputs)
    through = Equations((), tuple(signals), (), (), (), output_equations)
    return through, file.model_copy(update={"inputs": signals, "states": {}})


def rate_signals(file: ModelFile) -> Equations:
    """Return the signals used by effects at rates: inputs, and states with their rates."""
    return Equations((), tuple(file.inputs), tuple(file.states), (), (), ())


def parts_of_row(effects: Sequence[SeamEffect]) -> int:
    """Return the number of substeps per row for effects at inputs or outputs."""
    return FINER if any(map(_dynamic, effects)) else 1


def at_kind(kind: str, effects: Sequence[Effect]) -> list[SeamEffect]:
    """Return the effects at one kind of injection point: input, rate or output."""
    return [e for e in effects if isinstance(e, SeamEffect) and e.place.kind == kind]


def _interpolated_input(signal: Output | State) -> Input:
    return Input(role="", size=signal.size, held=False)


def _dynamic(effect: SeamEffect) -> bool:
    """Return whether the output of an effect can change within a row at constant input."""
    if effect.states or effect.uses == "along":
        return True
    arguments = inspect.signature(effect.act).parameters if effect.act is not None else {}
    return not {"past", "step", "elapsed"}.isdisjoint(arguments)


def _finer(rows: Floats, held: Sequence[bool], parts: int) -> Floats:
    """Split each row into parts: constant where held, else linear from the previous row."""
    level = np.repeat(rows, parts, axis=0)
    if parts == 1:
        return level
    previous = np.repeat(np.concatenate((rows[:1], rows[:-1])), parts, axis=0)
    share = np.tile(np.arange(1, parts + 1) / parts, len(rows))[:, None]
    return np.where(np.array(held), level, previous + share * (level - previous))


def _of_rows(fine: Floats, held: bool, parts: int) -> Floats:
    """Return the mean of each row where held, else its last value."""
    by_row = fine.reshape(-1, parts)
    return np.asarray(by_row.mean(axis=1) if held else by_row[:, -1])
