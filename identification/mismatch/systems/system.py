"""The system of a model file, for the mismatch engine."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

import numpy as np

from slipbench.identification.mismatch.simulation.causal_partition import (
    CausalPartition,
    OutputGroup,
    noise_memory,
)
from slipbench.identification.mismatch.simulation.coordinates import (
    NORMAL_95,
    STATED_SHARE,
    Coordinate,
)
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.once import once
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.regressor import DETAIL, TURN, kind_of, with_kinds
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.simulation.system import System
from slipbench.identification.mismatch.simulation.turn import Turn
from slipbench.identification.mismatch.simulation.written_units import WrittenUnits
from slipbench.identification.mismatch.systems import placing
from slipbench.identification.mismatch.systems.board import check_size
from slipbench.identification.mismatch.systems.delay_times import check_delays, check_length
from slipbench.identification.mismatch.systems.effects.seam_effect import INPUT, OUTPUT, SeamEffect
from slipbench.identification.mismatch.systems.equations import Equations, equations
from slipbench.identification.mismatch.systems.model_file import ModelFile, load_model_file
from slipbench.identification.mismatch.systems.record import (
    first_of,
    prepare,
    realigned,
    slow_places,
)
from slipbench.identification.mismatch.systems.run import SimulatedColumns
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

TIME = "time"
DRIVE = "system"
ORDER = 12
BINS_PER_LAG = 60
"""Least number of bins of a recording per lag of its noise model."""
IMPROVED = "Calibrated on recordings, with the effects found there"
DISTURBANCE = 0.1
"""Amplitude of a trial input disturbance, in the usual magnitude of its place."""


@dataclass(frozen=True, eq=False)
class ModelSystem(System):
    """A system of a model file.

    simulator: runs its tasks. values: of its parameters, SI, in the file's order. acting: effects
    that act. curves: free curves of the file. known: 95 % half widths. source: text of the file.
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
    coordinate_bound = 3.0  # beyond: missing physics, not another parameter value

    @classmethod
    def load(cls, path: Path) -> Self:
        """Load a model file. Raises InputError."""
        return replace(
            cls.of(load_model_file(path), path.name), source=path.read_text(encoding="utf-8")
        )

    @classmethod
    def of(cls, file: ModelFile, where: str, simulator: Simulator | None = None) -> Self:
        """Return the system of a model file. where: its name, for messages.

        simulator: replaces the file's equations. Raises InputError.
        """
        read = equations(file, where)
        check_delays(read, file, where)
        if simulator is None:
            check_size(read, where)
        values = np.array([number.si for number in file.parameters.values()])
        acting = tuple(
            placing.acting(e, file, f"{where}: effects[{i}]") for i, e in enumerate(file.effects)
        )
        half_widths_by_key = {
            f"parameters.{name}": _plus_minus(number.si, number.si_plus_minus)
            for name, number in file.parameters.items()
        }
        used_simulator = simulator or CompiledEquations(read)
        curves = tuple(
            read_curve(c, read, file, f"{where}: curves[{i}]") for i, c in enumerate(file.curves)
        )
        for entry, curve in zip(file.curves, curves, strict=True):
            half_widths_by_key |= half_widths(entry, curve)
        return cls(
            file,
            where,
            read,
            used_simulator,
            values,
            acting,
            half_widths_by_key,
            placing.Read(file),
            curves=curves,
        )

    def with_half_a_step(self) -> Self | None:
        """Return the system with half of the step; None for an outside simulation."""
        if not isinstance(self.simulator, CompiledEquations):
            return None
        return replace(self, file=self.file.model_copy(update={"step": 0.5 * self.file.step}))

    @property
    def notes(self) -> tuple[str, ...]:
        """Equations with inconsistent units; none for an outside simulation."""
        inside = isinstance(self.simulator, CompiledEquations)
        return unit_faults(self.file, self.where) if inside else ()

    @property
    def units(self) -> Mapping[str, str]:  # type: ignore[override]
        """Units of all quantities and of their rates."""
        found = {"time": "s"}
        parts = (self.file.inputs, self.file.states, self.file.seams, self.file.outputs)
        for part in parts:
            for name, entry in part.items():
                unit = entry.size.si_unit
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
        """Every effect at every place where it may act."""
        assert self.read is not None
        return placing.library(self.read)

    @property
    def plus_minus(self) -> Mapping[str, float]:
        """95 % half widths, SI."""
        return self.known

    def at(self, known: Sequence[Coordinate], x: Floats, effects: Sequence[Effect]) -> Self:
        """Return the system at coordinates x, (n,), with these effects added or replaced."""
        values = self.values.copy()
        curves = {c.owner: c for c in self.curves}
        for coordinate, position in zip(known, x, strict=True):
            owner, value = coordinate.owner, coordinate.at(float(position))
            if owner in curves:
                curves[owner] = curves[owner].with_height(int(coordinate.name), value)
            else:
                values[self.equations.parameters.index(coordinate.name)] = value
        new = {e.key for e in effects}
        kept = tuple(e for e in self.acting if e.key not in new)
        values = self.simulator.bounded(values)
        return replace(self, values=values, acting=(*kept, *effects), curves=tuple(curves.values()))

    def as_improved(self, plus_minus: Mapping[str, float]) -> Self:
        """Return the system named as improved, with these half widths."""
        description = self.file.description or IMPROVED
        file = self.file.model_copy(
            update={"name": f"{self.file.name} improved", "description": description}
        )
        return replace(self, file=file, known=dict(plus_minus))

    def text(self) -> str:
        """Return the text of the model file."""
        effects = tuple(e for e in self.acting if isinstance(e, SeamEffect))
        curves = (*self.curves, *(e for e in self.acting if isinstance(e, TableCurve)))
        tables = (*curves_as_tables(curves, self.file, self.known, self.written),)
        return as_text(
            self.source, self.file, self.values, effects, self.known, self.written, tables
        )

    @property
    def written(self) -> WrittenUnits:
        """Units of the model file."""
        parts = (self.file.inputs, self.file.states, self.file.seams, self.file.outputs)
        sizes = {_word(name): entry.size for part in parts for name, entry in part.items()}
        own = {name: (size.si_unit, size.unit) for name, size in sizes.items()}
        return WrittenUnits.of_tree(self.file.model_dump(), own)

    def prepare(self, recording: Recording) -> Record:
        """Prepare a recording. Raises InputError where it cannot be used or simulated."""
        recording, pattern_notes = without_patterns(recording, self.file)
        record = prepare(recording, self.file)
        record = replace(record, notes=(*record.notes, *pattern_notes))
        check_length(self.equations, self.values, record, self.where)
        q = np.zeros(record.slow.shape[1])
        try:
            simulated = self.simulator.first_run(self._task(record, q, {}))
        except PlantError as fault:
            raise InputError(
                f"{self.simulator.what} cannot be simulated with its nominal parameters",
                where=f"{self.where} on {recording.folder}",
                found=str(fault),
                remedy=self.simulator.remedy,
            ) from fault
        return realigned(record, recording, self.file, simulated)

    def duration(self, recordings: int) -> str:
        """Return a text on the duration of the analysis of prepared recordings; empty: short."""
        return self.simulator.duration(recordings)

    def check(self, record: Record) -> None:
        """Accept every recording: `prepare` has checked its inputs and outputs."""

    def partition(self, records: Sequence[Record]) -> CausalPartition:
        """Return one subsystem with an output group for each output that all records have.

        The subsystem is driven by the recorded inputs.
        """
        common = set.intersection(*(set(r.sensors) for r in records))
        order = max(1, min([ORDER, *(r.grid.bins // BINS_PER_LAG for r in records)]))
        outputs = [name for name in self.file.outputs if name in common]
        memory = noise_memory(records)
        groups = (OutputGroup(_word(n), DRIVE, (n,), order, memory) for n in outputs)
        return CausalPartition({DRIVE: ()}, tuple(groups))

    def coordinates(
        self, records: Sequence[Record], partition: CausalPartition
    ) -> list[Coordinate]:
        """List the parameters and values of curves, without exact ones (plus_minus = 0)."""
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

    def affected_subsystems(
        self, partition: CausalPartition, coordinate: Coordinate
    ) -> tuple[str, ...]:
        """Return the only subsystem."""
        return (DRIVE,)

    def slow_subsystems(self, partition: CausalPartition) -> tuple[str, ...]:
        """Return the only subsystem."""
        return (DRIVE,)

    def concerns(self, effect: Effect, partition: CausalPartition, subsystem: str) -> bool:
        """Return True: there is only one subsystem."""
        return True

    def simulate(self, given: SimulationInput) -> SimulatedColumns:
        """Simulate a record; each column has shape (rows,)."""
        return self.simulator.run(self._task(given.record, given.q, given.added))

    def _task(self, record: Record, q: Floats, added: Mapping[str, Floats]) -> Task:
        names = self.equations.places
        disturbance = np.zeros((record.grid.rows, len(names)))
        for k, place in enumerate(slow_places(self.file, record.grid)):
            disturbance[:, place] += record.slow[:, k] * q[k]
        for name, waveform in added.items():
            disturbance[:, names.index(name)] += waveform
        return Task(self.file, self.values, (*self.curves, *self.acting), record, disturbance)

    def unseen_turns(self) -> tuple[Turn, ...]:
        """Return the order lines of the unmeasured angle."""
        return tuple(placing.lines(self.file))

    def turns_unseen(self) -> bool:
        """Return whether an effect or a curve depends on the unmeasured angle."""
        return any(e.unseen_turn for e in (*self.curves, *self.acting))

    def without_unseen_turns(self) -> Self:
        """Return the system with the effects and curves of the unmeasured angle set to zero."""
        curves = tuple(c.silent() if c.unseen_turn else c for c in self.curves)
        acting = tuple(e.silent() if e.unseen_turn else e for e in self.acting)
        return replace(self, curves=curves, acting=acting)

    def first_angle(self) -> tuple[int, float] | None:
        """Return the slow column of the unmeasured angle's initial value, and rad per unit."""
        return first_of(placing.unseen_angle(self.file), self.file)

    def places(self, partition: CausalPartition) -> list[InjectionPoint]:
        """Return the injection points: inputs, seams and rates of states."""
        return [
            InjectionPoint(
                _word(p.name),
                p.name,
                p.unit,
                DISTURBANCE * p.size,
                DRIVE,
                {p.name: 1.0},
                recorded=p.kind == INPUT,
            )
            for p in placing.places(self.file)
            if p.kind != OUTPUT
        ]

    def curve(
        self, place: InjectionPoint, regressor: str, knots: Floats, values: Floats, number: int
    ) -> Effect | None:
        """Return an in-model spline at a place; None where the kernel lacks the regressor there.

        knots, values: (n,), SI. An outside simulation has no in-model splines. A periodic curve has
        mean 0: a constant does not depend on the angle, and parameters would compensate it.
        """
        kind = kind_of(regressor)
        quantity = regressor.removeprefix(kind) if kind in (TURN, DETAIL) else regressor
        along = quantity.replace(" ", "_")
        at = place.name.replace(" ", "_") if place.inputs else place.block.removesuffix(" sensor")
        if not self.simulator.knows_curves or along not in known_quantities(
            at, self.equations, self.file
        ):
            return None
        periodic = kind == TURN
        values = values - values.mean() if periodic else values
        table = (tuple(map(float, knots)), tuple(map(float, values)))
        return curve_along(self.file, at, along, *table, periodic)

    def input_disturbance(
        self, place: InjectionPoint, record: Record, course: Floats
    ) -> dict[str, Floats]:
        """Return the waveform for each quantity of the place, times its factor, shape (rows,), SI.

        course: the waveform, in the unit of the place, SI, shape (rows,).
        """
        return {name: factor * course for name, factor in place.inputs.items()}

    def regressors(self, given: SimulationInput) -> Mapping[str, Floats]:
        """Return recorded inputs, simulated states and seams, their rates, and time.

        SI, shape (rows,) each; (2, rows) for a scale.
        """
        record, out = given.record, self.simulate(given)
        found = {TIME: record.time}
        for k, name in enumerate(self.equations.inputs):
            found[_word(name)] = record.inputs[:, k]
        for name in (*self.equations.states, *(n for n, _ in self.equations.seams)):
            found[_word(name)] = out[name]
        for name in record.sensors:
            found.setdefault(_word(name), out[name])
        if self.operating not in found:  # an output that was not recorded
            found[self.operating] = out[next(iter(self.file.outputs))]
        rates = {f"{n} rate": record.grid.rate(c) for n, c in found.items()}
        del rates[f"{TIME} rate"]
        turns = {
            f"{TURN}{_word(n)}": self._angle(n, record, out) for n in placing.turning(self.file)
        }
        outputs = {_word(name) for name in record.sensors}
        return {**self._of_all_kinds(found, outputs), **rates, **turns}

    def _of_all_kinds(
        self, quantities: Mapping[str, Floats], outputs: set[str]
    ) -> dict[str, Floats]:
        """Return quantities and the regressors of their past, hysteresis, detail and scale.

        A seam or an output that renames a quantity has no regressors of its own. The past of a state
        follows from that of the inputs. The scale of a quantity varies over time and over measured
        quantities.
        """
        inputs = {_word(n) for n in self.equations.inputs}
        renamed = self._renamed
        names = [n for n in quantities if n != TIME and n not in renamed]
        measured = {renamed.get(o, o) for o in outputs}
        over = [TIME, *(n for n in names if n in measured)]
        return with_kinds(
            quantities,
            past=[n for n in names if n in inputs],
            hysteresis=names,
            detail=names,
            scaled=[(n, other) for n in names for other in over if n != other],
        )

    @once
    def _renamed(self) -> dict[str, str]:
        """The quantity of every seam and output whose equation is only its name."""
        found: dict[str, str] = {}
        own = {*self.equations.inputs, *self.equations.states}
        equations = {n: seam.value for n, seam in self.file.seams.items()}
        equations |= {n: output.value for n, output in self.file.outputs.items()}
        for name, equation in equations.items():
            value = equation.strip()
            if name not in own and value in own | self.file.seams.keys():
                found[_word(name)] = found.get(_word(value), _word(value))
        return found

    def _angle(self, name: str, record: Record, out: SimulatedColumns) -> Floats:
        """Return an angle, (rows,): recorded, else simulated, perhaps with a phase error."""
        if name in self.file.inputs:
            return record.inputs[:, self.equations.inputs.index(name)]
        measuring = (n for n, o in self.file.outputs.items() if o.value.strip() == name)
        return next((record.measured[n] for n in measuring if n in record.measured), out[name])

    def turn_of(self, effect: Effect) -> str:
        """Return the regressor of the angle that an effect uses, over a turn; empty: none."""
        if isinstance(effect, SeamEffect) and effect.uses == "turn":
            return f"{TURN}{_word(effect.place.other)}"
        return ""


def _word(name: str) -> str:
    return name.replace("_", " ")


def _plus_minus(value: float, stated: float | None) -> float:
    return STATED_SHARE * abs(value) if stated is None else stated
