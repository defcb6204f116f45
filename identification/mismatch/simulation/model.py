"""The simulation put beside the recordings: from coordinates and effects to what sensors show."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from slipbench.identification.mismatch.simulation.causal_partition import (
    CausalPartition,
    OutputGroup,
)
from slipbench.identification.mismatch.simulation.coordinates import Coordinate
from slipbench.identification.mismatch.simulation.derivatives import Derivatives
from slipbench.identification.mismatch.simulation.input_disturbance import InputDisturbance
from slipbench.identification.mismatch.simulation.once import once
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sensor import Columns, Rounds, Sensor
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.effects.effect import Effect
from slipbench.plant.encoder import Misplaces
from slipbench.plant.signals import Floats

Series = list[list[Floats]]
"""By block and record: (T, m)."""
Runs = dict[tuple[int, str], Columns]
"""Simulations by record and drive."""
LOOK = 0.02
"""Of a coordinate, between two looks of a sensor at a simulation."""
PUNCTUAL: Mapping[str, float] = {}


@dataclass(frozen=True)
class Point:
    """Where the model stands. x: coordinates of the system; q: slow unknown by record; effects."""

    x: Floats
    q: tuple[Floats, ...]
    effects: tuple[Effect, ...] = ()


@dataclass(frozen=True, eq=False)
class Model:
    """Records, the blocks they carry, and what is uncertain of the system.

    injected: by record, columns of the inputs to which something is added at every simulation.
    stepless: whether sensors tell without the coarse steps that an effect gives them.
    """

    system: System
    records: tuple[Record, ...]
    partition: CausalPartition
    known: list[Coordinate]
    injected: tuple[Mapping[str, Floats], ...] = field(default=())
    stepless: bool = False

    @once
    def measured(self) -> Series:
        """What was recorded."""
        return [[_stack(b, r, None) for r in self.records] for b in self.partition.groups]

    @once
    def known_bins(self) -> Series:
        """1 where something was recorded, 0 elsewhere."""
        return [
            [
                np.column_stack([r.sensors[o].known for o in b.outputs]).astype(float)
                for r in self.records
            ]
            for b in self.partition.groups
        ]

    @once
    def clocks(self) -> list[tuple[int, Coordinate]]:
        """What is uncertain of the clocks, with the number of each coordinate."""
        return [(i, k) for i, k in enumerate(self.known) if k.of_clock]

    @once
    def coarse(self) -> "Model":
        """The same with coarser steps of integration, to compare simulations with each other."""
        model = self._like(replace(self, system=self.system.coarse()))
        model.__dict__["coarse"] = model
        return model

    @once
    def for_slopes(self) -> "Model":
        """The coarse one without what sensors round: a staircase has no slope that leads on."""
        return self._like(replace(self.coarse, stepless=True))

    def _like(self, other: "Model") -> "Model":
        """Return another of the same records, what was measured shared."""
        other.__dict__.update(measured=self.measured, known_bins=self.known_bins)
        return other

    def uncertain_of(self, known: list[Coordinate]) -> "Model":
        """Return the same, certain of all other numbers; with coarse steps if this one has them."""
        model = self._like(replace(self, known=known))
        if self.coarse is self:
            model.__dict__["coarse"] = model
        return model

    def until(self, share: float) -> "Model":
        """Return the same, of which only the beginning of each record counts as recorded.

        Patterns of teeth have no beginning: they count as a whole.
        """
        parts = [share if block.order else 1.0 for block in self.partition.groups]
        known = [
            [k * (np.arange(len(k)) < part * len(k))[:, None] for k in ks]
            for part, ks in zip(parts, self.known_bins, strict=True)
        ]
        model = replace(self)
        model.__dict__.update(measured=self.measured, known_bins=known)
        if self.coarse is self:
            model.__dict__["coarse"] = model
        return model

    def origin(self) -> Point:
        """Return the system as its file tells it, with nothing slow acting."""
        slow = tuple(np.zeros(r.slow.shape[1]) for r in self.records)
        return Point(np.zeros(len(self.known)), slow)

    def at(self, point: Point) -> System:
        """Return the system that a point describes, effects of its file included."""
        known_to_it = [e for e in point.effects if not isinstance(e, InputDisturbance)]
        return self.system.at(self.known, point.x, known_to_it)

    def subsystems_changed_by(self, effect: Effect) -> tuple[str, ...]:
        """Return the drives of which an effect can change what the outputs show."""
        if isinstance(effect, InputDisturbance):
            return (effect.subsystem,)
        return tuple(
            d for d in self.partition.subsystems if self.system.concerns(effect, self.partition, d)
        )

    def changes_only_sensors(self, effect: Effect) -> bool:
        """Tell whether an effect leaves every simulation as it is."""
        return not isinstance(effect, InputDisturbance) and self.system.changes_only_sensors(
            effect, self.partition
        )


def models(system: System, *sets: Sequence[Record]) -> list[Model]:
    """Put a system beside sets of recordings, cut alike and with the same uncertain numbers."""
    ready = [r for records in sets for r in records]
    cut = system.partition(ready)
    known = system.coordinates(ready, cut)
    return [Model(system, tuple(records), cut, known) for records in sets]


def acting(
    model: Model, point: Point, record: int, extra: Mapping[str, Floats] | None = None
) -> dict[str, Floats]:
    """Return what is added to columns of a record's inputs: injected, pushed at a point, extra."""
    pushed = [e.waveforms[record] for e in point.effects if isinstance(e, InputDisturbance)]
    found: dict[str, Floats] = {}
    for courses in (*model.injected[record : record + 1], *pushed, extra or {}):
        for name, course in courses.items():
            found[name] = found[name] + course if name in found else course
    return found


def simulate(
    model: Model,
    point: Point,
    record: int,
    subsystem: str,
    extra: Mapping[str, Floats] | None = None,
    system: System | None = None,
) -> Columns:
    """Run one drive of one record. extra: what is added to columns of the inputs."""
    there = model.at(point) if system is None else system
    added = acting(model, point, record, extra)
    return there.simulate(model.records[record], model.partition, subsystem, point.q[record], added)


def predict(
    model: Model,
    point: Point,
    subsystems: Iterable[str] | None = None,
    records: Iterable[int] | None = None,
    runs: Runs | None = None,
) -> Series:
    """Return what the sensors would show; blocks of other drives or records are left empty.

    runs: simulations that hold for this point, if there are any; those made here are added.
    """
    system = model.at(point)
    effects = [e for e in system.effects if not (model.stepless and isinstance(e, Rounds))]
    wanted = set(model.partition.subsystems if subsystems is None else subsystems)
    found: Series = [[np.empty(0)] * len(model.records) for _ in model.partition.groups]
    for r in range(len(model.records)) if records is None else records:
        outs = {d: _run(model, point, r, d, runs, system) for d in wanted}
        for b, block in enumerate(model.partition.groups):
            if block.subsystem in wanted:
                record = model.records[r]
                seen = _stack(
                    block, record, outs[block.subsystem], effects, lateness(model, point, block)
                )
                misplace(seen, block.outputs, record, system.effects)
                found[b][r] = seen
    return found


def look_along(
    model: Model, point: Point, system: System, block: int, record: int, run: Derivatives
) -> Floats:
    """Return how a block's outputs change with what a run was differentiated to, (T, m, k)."""
    sensors, effects, late = _seen_by(model, point, system, block, record)
    shown = [
        s.observe_derivatives(run.out, run.slopes, effects, late.get(s.clock, 0.0), LOOK)
        for s in sensors
    ]
    return np.stack(shown, axis=1)


def late_slopes(
    model: Model, point: Point, system: System, block: int, record: int, out: Columns
) -> dict[int, Floats]:
    """Return how a block's outputs change with each clock's coordinate, (T, m) by its number."""
    sensors, effects, late = _seen_by(model, point, system, block, record)
    found = {}
    for i, known in enumerate(model.known):
        if known.name in late and known.of_clock:
            step = LOOK * known.slope(float(point.x[i]))
            there = {**late, known.name: late[known.name] + step}
            both = [
                np.column_stack([s.observe(out, effects, d.get(s.clock, 0.0)) for s in sensors])
                for d in (there, late)
            ]
            found[i] = (both[0] - both[1]) / LOOK
    return found


def _seen_by(
    model: Model, point: Point, system: System, block: int, record: int
) -> tuple[list[Sensor], list[Effect], dict[str, float]]:
    """Sensors of a block, effects that act in them, and by how much their clocks tell too much."""
    effects = [e for e in system.effects if not (model.stepless and isinstance(e, Rounds))]
    cut = model.partition.groups[block]
    sensors = [model.records[record].sensors[o] for o in cut.outputs]
    return sensors, effects, lateness(model, point, cut)


def _run(
    model: Model, point: Point, record: int, subsystem: str, runs: Runs | None, system: System
) -> Columns:
    if runs is None:
        return simulate(model, point, record, subsystem, system=system)
    if (record, subsystem) not in runs:
        runs[record, subsystem] = simulate(model, point, record, subsystem, system=system)
    return runs[record, subsystem]


def lateness(model: Model, point: Point, block: OutputGroup) -> dict[str, float]:
    """Return by how many seconds each clock shows more than it should, where that is doubted."""
    clocks = model.clocks if block.sensors_suspected else ()
    return {k.name: k.at(float(point.x[i])) for i, k in clocks}


def misplace(
    seen: Floats, outputs: Iterable[str], record: Record, effects: Iterable[Effect]
) -> None:
    """Add to outputs (T, m) what displaced teeth make of them."""
    for effect in effects:
        if hasattr(effect, "tooth_offsets"):
            assert isinstance(effect, Misplaces)
            for j, output in enumerate(outputs):
                sensor = record.sensors[output]
                if sensor.offsets is not None and output.startswith(effect.encoder.split("_")[0]):
                    seen[:, j] += sensor.misplaced(effect.tooth_offsets(sensor.offsets.shape[1]))


def _stack(
    block: OutputGroup,
    record: Record,
    out: Columns | None,
    effects: Iterable[Effect] = (),
    late: Mapping[str, float] = PUNCTUAL,
) -> Floats:
    """Put a block's outputs side by side, (T, m): as recorded where no simulation is given."""
    sensors = [record.sensors[o] for o in block.outputs]
    return np.column_stack(
        [
            s.value if out is None else s.observe(out, effects, late.get(s.clock, 0.0))
            for s in sensors
        ]
    )
