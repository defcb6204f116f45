"""What a model file tells, as a system that the engine explains."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

import numpy as np

from slipbench.identification.mismatch.simulation.causal_partition import (
    CausalPartition,
    OutputGroup,
)
from slipbench.identification.mismatch.simulation.coordinates import (
    NORMAL_95,
    STATED_SHARE,
    Coordinate,
)
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.regressor import TURN, kind_of
from slipbench.identification.mismatch.simulation.system import System
from slipbench.identification.mismatch.simulation.turn import Turn
from slipbench.identification.mismatch.simulation.written_units import WrittenUnits
from slipbench.identification.mismatch.systems import placing
from slipbench.identification.mismatch.systems.board import check_size
from slipbench.identification.mismatch.systems.delay_times import check_delays, check_length
from slipbench.identification.mismatch.systems.effects.seam_effect import OUTPUT, SeamEffect
from slipbench.identification.mismatch.systems.equations import Equations, equations
from slipbench.identification.mismatch.systems.model_file import ModelFile, load_model_file
from slipbench.identification.mismatch.systems.record import (
    first_of,
    prepare,
    realigned,
    slow_places,
)
from slipbench.identification.mismatch.systems.run import Shown
from slipbench.identification.mismatch.systems.simulator import CompiledEquations, Simulator, Task
from slipbench.identification.mismatch.systems.table_curve import (
    TableCurve,
    curve_along,
    half_widths,
    known_quantities,
    read_curve,
)
from slipbench.identification.mismatch.systems.turn_pattern import without_patterns
from slipbench.identification.mismatch.systems.unit_check import unit_faults
from slipbench.identification.mismatch.systems.writing import as_text, curves_as_tables
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.recording import Recording

DRIVE = "system"
ORDER = 12
BINS_PER_LAG = 60
"""Least bins of a recording for each lag of its noise model."""
MEMORY = 1 / 3
"""Of the noise models, in stretches: errors that far apart have little in common."""
IMPROVED = "Calibrated on recordings, with the effects found there"
DISTURBANCE = 0.1
"""Size of a push worth trying, in the usual magnitude of its place."""


@dataclass(frozen=True, eq=False)
class ModelSystem(System):
    """A system of a model file.

    simulator: what runs it. values: of its parameters, SI, in the file's order. acting: effects.
    curves: free curves of the file. known: 95 % half widths. source: text of the file.
    """

    file: ModelFile
    where: str
    equations: Equations
    simulator: Simulator
    values: Floats
    acting: tuple[Effect, ...] = ()
    known: Mapping[str, float] = field(default_factory=dict)
    read: placing.Read | None = None
    source: str = ""
    curves: tuple[TableCurve, ...] = ()

    smooth = True
    farthest = 3.0  # beyond lies not another value of a parameter but physics that is missing

    @classmethod
    def load(cls, path: Path) -> Self:
        """Load a model file. Raises InputError."""
        return replace(
            cls.of(load_model_file(path), path.name), source=path.read_text(encoding="utf-8")
        )

    @classmethod
    def of(cls, file: ModelFile, where: str, simulator: Simulator | None = None) -> Self:
        """Make the system of a model file. where: its name, for messages.

        simulator: what runs it in place of the file's equations. Raises InputError.
        """
        read = equations(file, where)
        check_delays(read, file, where)
        if simulator is None:
            check_size(read, where)
        values = np.array([number.si for number in file.parameters.values()])
        acts = tuple(
            placing.acting(e, file, f"{where}: effects[{i}]") for i, e in enumerate(file.effects)
        )
        told = {
            f"parameters.{name}": _plus_minus(number.si, number.si_plus_minus)
            for name, number in file.parameters.items()
        }
        runs = simulator or CompiledEquations(read)
        curves = tuple(
            read_curve(c, read, file, f"{where}: curves[{i}]") for i, c in enumerate(file.curves)
        )
        for entry, curve in zip(file.curves, curves, strict=True):
            told |= half_widths(entry, curve)
        return cls(file, where, read, runs, values, acts, told, placing.Read(file), curves=curves)

    def with_half_a_step(self) -> Self | None:
        """Return the same with half of the step; None for what is simulated outside."""
        if not isinstance(self.simulator, CompiledEquations):
            return None
        return replace(self, file=self.file.model_copy(update={"step": 0.5 * self.file.step}))

    @property
    def notes(self) -> tuple[str, ...]:
        """Equations whose units do not agree; what is simulated outside has none."""
        inside = isinstance(self.simulator, CompiledEquations)
        return unit_faults(self.file, self.where) if inside else ()

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        """Units of all quantities and of their rates."""
        found = {"time": "s"}
        parts = (self.file.inputs, self.file.states, self.file.seams, self.file.outputs)
        for part in parts:
            for name, told in part.items():
                unit = told.size.si_unit
                found[_word(name)] = unit
                found[f"{_word(name)} rate"] = "1/s" if unit == "1" else f"{unit}/s"
        return found

    @property
    def operating(self) -> str:  # type: ignore[override]
        """The first input; without inputs the first state; without states the first output."""
        return _word(next(iter(self.file.inputs or self.file.states or self.file.outputs)))

    @property
    def direction(self) -> str:  # type: ignore[override]
        """The rate of the operating quantity."""
        return f"{self.operating} rate"

    @property
    def name(self) -> str:
        """Name in the file."""
        return self.file.name

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Effects that act."""
        return self.acting

    @property
    def library(self) -> tuple[type[Effect], ...]:
        """Every effect at every place."""
        assert self.read is not None
        return placing.library(self.read)

    @property
    def plus_minus(self) -> Mapping[str, float]:
        """95 % half widths, SI."""
        return self.known

    def at(self, known: Sequence[Coordinate], x: Floats, effects: Sequence[Effect]) -> Self:
        """Return it with other numbers."""
        values = self.values.copy()
        curves = {c.owner: c for c in self.curves}
        for coordinate, place in zip(known, x, strict=True):
            owner, value = coordinate.owner, coordinate.at(float(place))
            if owner in curves:
                curves[owner] = curves[owner].with_height(int(coordinate.name), value)
            else:
                values[self.equations.parameters.index(coordinate.name)] = value
        new = {e.key for e in effects}
        kept = tuple(e for e in self.acting if e.key not in new)
        values = self.simulator.bounded(values)
        return replace(self, values=values, acting=(*kept, *effects), curves=tuple(curves.values()))

    def as_improved(self, plus_minus: Mapping[str, float]) -> Self:
        """Return it under an improved one's name."""
        told = self.file.description or IMPROVED
        file = self.file.model_copy(
            update={"name": f"{self.file.name} improved", "description": told}
        )
        return replace(self, file=file, known=dict(plus_minus))

    def text(self) -> str:
        """Return the model file."""
        effects = tuple(e for e in self.acting if isinstance(e, SeamEffect))
        curves = (*self.curves, *(e for e in self.acting if isinstance(e, TableCurve)))
        told = (*curves_as_tables(curves, self.file, self.known, self.written),)
        return as_text(self.source, self.file, self.values, effects, self.known, self.written, told)

    @property
    def written(self) -> WrittenUnits:
        """Units of the model file."""
        parts = (self.file.inputs, self.file.states, self.file.seams, self.file.outputs)
        sizes = {_word(name): told.size for part in parts for name, told in part.items()}
        own = {name: (size.si_unit, size.unit) for name, size in sizes.items()}
        return WrittenUnits.of_tree(self.file.model_dump(), own)

    def prepare(self, recording: Recording) -> Record:
        """Make a recording ready."""
        recording, found = without_patterns(recording, self.file)
        record = prepare(recording, self.file)
        record = replace(record, notes=(*record.notes, *found))
        check_length(self.equations, self.values, record, self.where)
        q = np.zeros(record.slow.shape[1])
        try:
            shown = self.simulator.first_run(self._task(record, q, {}))
        except PlantError as fault:
            raise InputError(
                f"{self.simulator.what} cannot be simulated with its nominal parameters",
                where=f"{self.where} on {recording.folder}",
                found=str(fault),
                remedy=self.simulator.remedy,
            ) from fault
        return realigned(record, recording, self.file, shown)

    def duration(self, recordings: int) -> str:
        """Say how long the analysis of so many prepared recordings takes; empty: not long."""
        return self.simulator.duration(recordings)

    def check(self, record: Record) -> None:
        """A recording with its inputs and an output is taken as one of it."""

    def partition(self, records: Sequence[Record]) -> CausalPartition:
        """One drive, led by the recorded inputs; a block for every output that all records have."""
        has = set.intersection(*(set(r.sensors) for r in records))
        order = max(1, min([ORDER, *(r.grid.bins // BINS_PER_LAG for r in records)]))
        shown = [name for name in self.file.outputs if name in has]
        memory = MEMORY * min(r.grid.stretch / r.grid.width for r in records)
        blocks = (OutputGroup(_word(n), DRIVE, (n,), order, memory=memory) for n in shown)
        return CausalPartition({DRIVE: ()}, tuple(blocks))

    def coordinates(
        self, records: Sequence[Record], partition: CausalPartition
    ) -> list[Coordinate]:
        """List the parameters and the values of curves; those with plus_minus = 0 are exact."""
        found: list[Coordinate] = []
        for name, value in zip(self.equations.parameters, self.values, strict=True):
            half = self.known[f"parameters.{name}"]
            if half > 0.0:
                linear = value <= 0.0
                scale = half / NORMAL_95 / (1.0 if linear else float(value))
                found.append(Coordinate("parameters", name, float(value), scale, linear))
        for curve in self.curves:
            found += curve.coordinates(self.known)
        return found

    def touched(self, partition: CausalPartition, coordinate: Coordinate) -> tuple[str, ...]:
        """There is one drive."""
        return (DRIVE,)

    def slow_subsystems(self, partition: CausalPartition) -> tuple[str, ...]:
        """There is one drive."""
        return (DRIVE,)

    def concerns(self, effect: Effect, partition: CausalPartition, subsystem: str) -> bool:
        """There is one drive."""
        return True

    def simulate(
        self,
        record: Record,
        partition: CausalPartition,
        subsystem: str,
        q: Floats,
        added: Mapping[str, Floats],
    ) -> Shown:
        """Run it."""
        return self.simulator.run(self._task(record, q, added))

    def _task(self, record: Record, q: Floats, added: Mapping[str, Floats]) -> Task:
        names = self.equations.places
        push = np.zeros((record.grid.rows, len(names)))
        for k, place in enumerate(slow_places(self.file, record.grid)):
            push[:, place] += record.slow[:, k] * q[k]
        for name, course in added.items():
            push[:, names.index(name)] += course
        return Task(self.file, self.values, (*self.curves, *self.acting), record, push)

    def unseen_turns(self) -> tuple[Turn, ...]:
        """Return the orders of an unseen angle."""
        return tuple(placing.lines(self.file))

    def turns_unseen(self) -> bool:
        """Tell whether an effect or a curve goes with the unseen angle."""
        return any(e.unseen_turn for e in (*self.curves, *self.acting))

    def silenced(self) -> Self:
        """Return it with nothing that goes with the unseen angle."""
        curves = tuple(c.silent() if c.unseen_turn else c for c in self.curves)
        acting = tuple(e.silent() if e.unseen_turn else e for e in self.acting)
        return replace(self, curves=curves, acting=acting)

    def first_angle(self) -> tuple[int, float] | None:
        """Return the unknown of the unseen angle."""
        return first_of(placing.unseen_angle(self.file), self.file)

    def places(self, partition: CausalPartition) -> list[InjectionPoint]:
        """Inputs, seams and rates of states."""
        return [
            InjectionPoint(
                _word(p.name), p.name, p.unit, DISTURBANCE * p.size, DRIVE, {p.name: 1.0}
            )
            for p in placing.places(self.file)
            if p.kind != OUTPUT
        ]

    def curve(
        self, place: InjectionPoint, regressor: str, knots: Floats, values: Floats, number: int
    ) -> Effect | None:
        """Return a curve of the model file; None along what the kernel does not know there.

        A simulation from outside knows none. Around a turn the mean is left out: what is there all round
        is none of the angle's, and parameters that make up for it would leave with the curve.
        """
        along, at = (n.replace(" ", "_") for n in (regressor.removeprefix(TURN), place.name))
        if not self.simulator.knows_curves or along not in known_quantities(
            at, self.equations, self.file
        ):
            return None
        repeats = kind_of(regressor) == TURN
        values = values - values.mean() if repeats else values
        table = (tuple(map(float, knots)), tuple(map(float, values)))
        return curve_along(self.file, at, along, *table, repeats)

    def input_disturbance(
        self, place: InjectionPoint, record: Record, course: Floats
    ) -> dict[str, Floats]:
        """Add it to the place's quantity."""
        return {name: factor * course for name, factor in place.inputs.items()}

    def regressors(
        self,
        record: Record,
        partition: CausalPartition,
        subsystem: str,
        q: Floats,
        added: Mapping[str, Floats],
    ) -> Mapping[str, Floats]:
        """Inputs as recorded, states and seams as simulated, all with their rates; and time."""
        out = self.simulate(record, partition, subsystem, q, added)
        found = {"time": record.time}
        for k, name in enumerate(self.equations.inputs):
            found[_word(name)] = record.inputs[:, k]
        for name in (*self.equations.states, *(n for n, _ in self.equations.seams)):
            found[_word(name)] = out[name]
        for name in record.sensors:
            found.setdefault(_word(name), out[name])
        if self.operating not in found:  # an output that was not recorded
            found[self.operating] = out[next(iter(self.file.outputs))]
        rates = {f"{n} rate": record.grid.rate(c) for n, c in found.items()}
        del rates["time rate"]
        turns = {
            f"{TURN}{_word(n)}": self._angle(n, record, out) for n in placing.turning(self.file)
        }
        return {**found, **rates, **turns}

    def _angle(self, name: str, record: Record, out: Shown) -> Floats:
        """Course of an angle: recorded, else as simulated, which may be ahead by part of a turn."""
        if name in self.file.inputs:
            return record.inputs[:, self.equations.inputs.index(name)]
        shown = (n for n, o in self.file.outputs.items() if o.value.strip() == name)
        return next((record.measured[n] for n in shown if n in record.measured), out[name])

    def turn_of(self, effect: Effect) -> str:
        """Return the turn of the angle that an effect uses."""
        if isinstance(effect, SeamEffect) and effect.uses == "turn":
            return f"{TURN}{_word(effect.place.other)}"
        return ""


def _word(name: str) -> str:
    return name.replace("_", " ")


def _plus_minus(value: float, told: float | None) -> float:
    return STATED_SHARE * abs(value) if told is None else told
