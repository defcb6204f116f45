"""Effects outside of a simulation, as operators on its input and output signals.

The laws are those of the seam effects of model files, and so is the kernel that runs them: a system
without states, whose equations pass each signal on. A held input keeps its steps: what a dynamic
effect makes of it within a row is replaced by its mean, as a sampled simulation is driven.
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
"""Parts of a row in which an effect with a memory is integrated."""
RAW = "simulated_"
"""Before the name of an output as the simulation gives it, before effects."""
NO_VALUES = np.zeros(0)


def shown_names(file: ModelFile) -> tuple[str, ...]:
    """Return the names of what a simulation shows: outputs, then the states of its file."""
    return (*file.outputs, *file.states)


def speeds_used(task: Task) -> bool:
    """Tell whether an effect at an input acts along an output or a state."""
    return any(e.place.other in shown_names(task.file) for e in at_kind(INPUT, task.effects))


def acted_inputs(task: Task, outputs: Floats) -> Floats:
    """Inputs with what is pushed and what acts there, (rows, inputs).

    outputs: (rows, outputs and states), along which some of it acts.
    """
    pushed = task.record.inputs + task.push[:, : len(task.file.inputs)]
    effects = at_kind(INPUT, task.effects)
    if not effects:
        return pushed
    parts = parts_of_row(effects)
    held = [i.steps for i in task.file.inputs.values()] + [False] * len(shown_names(task.file))
    alone, file = input_signals(task.file)
    grid = task.record.grid
    fine = replace(
        task.record,
        grid=replace(grid, rows=parts * grid.rows, step=grid.step / parts),
        inputs=_finer(np.concatenate((pushed, outputs), axis=1), held, parts),
    )
    still = np.zeros((parts * grid.rows, len(alone.inputs)))
    shown = run(alone, file, NO_VALUES, effects, fine, still)
    return np.column_stack(
        [_of_rows(shown[n], i.steps, parts) for n, i in task.file.inputs.items()]
    )


def acted_outputs(task: Task, inputs: Floats, raw: Floats) -> Floats:
    """Outputs with what acts there, (rows, outputs).

    inputs: as they act, (rows, inputs); raw: (rows, outputs and states).
    """
    effects = at_kind(OUTPUT, task.effects)
    if not effects:
        return raw[:, : len(task.file.outputs)]
    through, file = output_signals(task.file)
    file = file.model_copy(update={"step": task.record.grid.step / parts_of_row(effects)})
    record = replace(task.record, inputs=np.concatenate((inputs, raw), axis=1))
    shown = run(
        through, file, NO_VALUES, effects, record, np.zeros((len(raw), len(through.places)))
    )
    return np.column_stack([shown[n] for n in task.file.outputs])


def acting_rates(task: Task) -> ActingRates | None:
    """Return what acts on the rates of the file's states; None where nothing does."""
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
    """Return the signals that effects at inputs use, inputs first, as a system without states."""
    lines = {n: _line(o) for n, o in file.outputs.items()}
    lines |= {n: _line(s) for n, s in file.states.items()}
    signals = {**file.inputs, **lines}
    alone = Equations((), tuple(signals), (), (), (), ())
    return alone, file.model_copy(update={"inputs": signals, "states": {}})


def output_signals(file: ModelFile) -> tuple[Equations, ModelFile]:
    """Return the signals that effects at outputs use, as a system that passes the outputs on."""
    told = {f"{RAW}{n}": _line(o) for n, o in file.outputs.items()}
    told |= {n: _line(s) for n, s in file.states.items()}
    signals = {**file.inputs, **told}
    passed = tuple((n, f"{PREFIX}{RAW}{n}") for n in file.outputs)
    through = Equations((), tuple(signals), (), (), (), passed)
    return through, file.model_copy(update={"inputs": signals, "states": {}})


def rate_signals(file: ModelFile) -> Equations:
    """Return the signals that effects at rates use: inputs, and states with their rates."""
    return Equations((), tuple(file.inputs), tuple(file.states), (), (), ())


def parts_of_row(effects: Sequence[SeamEffect]) -> int:
    """Return into how many parts a row is cut for effects at inputs or outputs."""
    return FINER if any(map(_dynamic, effects)) else 1


def at_kind(kind: str, effects: Sequence[Effect]) -> list[SeamEffect]:
    """Return the effects at one kind of places."""
    return [e for e in effects if isinstance(e, SeamEffect) and e.place.kind == kind]


def _line(shown: Output | State) -> Input:
    return Input(role="", size=shown.size, held=False)


def _dynamic(effect: SeamEffect) -> bool:
    """Tell whether what an effect makes of a level input changes within a row."""
    if effect.states or effect.uses == "along":
        return True
    known = inspect.signature(effect.act).parameters if effect.act is not None else {}
    return not {"past", "step", "elapsed"}.isdisjoint(known)


def _finer(rows: Floats, held: Sequence[bool], parts: int) -> Floats:
    """Cut each row into parts, level where held, else along the line from the row before."""
    level = np.repeat(rows, parts, axis=0)
    if parts == 1:
        return level
    before = np.repeat(np.concatenate((rows[:1], rows[:-1])), parts, axis=0)
    share = np.tile(np.arange(1, parts + 1) / parts, len(rows))[:, None]
    return np.where(np.array(held), level, before + share * (level - before))


def _of_rows(fine: Floats, held: bool, parts: int) -> Floats:
    """Mean of each row where held, else its end."""
    whole = fine.reshape(-1, parts)
    return np.asarray(whole.mean(axis=1) if held else whole[:, -1])
