"""Simulators of a system: compiled equations of a model file, or an outside simulation.

Everything else about a system (places, effects, recordings, priors) comes from its model file and
is the same for both.
"""

from abc import ABC, abstractmethod
from dataclasses import dataclass

from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.systems.delay_times import without_negative
from slipbench.identification.mismatch.systems.equations import Equations
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.identification.mismatch.systems.run import SimulatedColumns, run
from slipbench.identification.mismatch.systems.stops import within_restitution
from slipbench.plant.effects.effect import Effect
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class Task:
    """One simulation: parameters (SI, in the file's order), effects, and the record of its inputs.

    push: input disturbances, (rows, places), added to the quantities of the places.
    """

    file: ModelFile
    values: Floats
    effects: tuple[Effect, ...]
    record: Record
    push: Floats


class Simulator(ABC):
    """Runs the tasks of one system.

    what: its name in messages; remedy: the advice where it cannot run with nominal parameters.
    knows_curves: whether it evaluates free curves over its simulated quantities.
    """

    what: str = "the model file"
    knows_curves: bool = False
    remedy: str = "check the parameters and the equations"

    @abstractmethod
    def run(self, task: Task) -> SimulatedColumns:
        """Run all rows of a task. Raises PlantError where that fails."""

    def first_run(self, task: Task) -> SimulatedColumns:
        """Run a task with nominal parameters. Raises InputError where it cannot be used at all."""
        return self.run(task)

    def duration(self, recordings: int) -> str:
        """Return a text on the duration of an analysis, after the first run; empty: short."""
        return ""

    def bounded(self, values: Floats) -> Floats:
        """Return the parameters, SI, (parameters,), limited to what the simulation accepts."""
        return values


@dataclass(frozen=True)
class CompiledEquations(Simulator):
    """Equations of a model file, compiled."""

    equations: Equations
    knows_curves = True

    def run(self, task: Task) -> SimulatedColumns:
        """Run the kernel."""
        return run(self.equations, task.file, task.values, task.effects, task.record, task.push)

    def bounded(self, values: Floats) -> Floats:
        """Return the parameters, SI, (parameters,), with delays from 0 and restitutions from 0 to 1."""
        e = self.equations
        return within_restitution(e.stops, e.parameters, without_negative(e, values))
