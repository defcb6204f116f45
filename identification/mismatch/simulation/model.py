"""Model of the recordings: from coordinates and effects to the predicted sensor outputs."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from slipbench.identification.mismatch.simulation.causal_partition import (
    CausalPartition,
    OutputGroup,
)
from slipbench.identification.mismatch.simulation.coordinates import Coordinate
from slipbench.identification.mismatch.simulation.derivatives import Derivatives
from slipbench.identification.mismatch.simulation.injection_point import SENSOR, at_sensor
from slipbench.identification.mismatch.simulation.input_disturbance import InputDisturbance
from slipbench.identification.mismatch.simulation.once import once
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.sensor import Columns, Quantizes, Sensor
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.effects.effect import Effect
from slipbench.plant.encoder import Misplaces
from slipbench.plant.signals import Floats

Series = list[list[Floats]]
"""By output group and record: (T, m)."""
Runs = dict[tuple[int, str], Columns]
"""Simulations by record and subsystem."""
DIFFERENCE_STEP = 0.02
"""Finite-difference step of a coordinate, for derivatives of sensor outputs."""
PUNCTUAL: Mapping[str, float] = {}


@dataclass(frozen=True)
class Point:
    """Parameter point. x: coordinates of the system; q: slow disturbance by record; effects."""

    x: Floats
    q: tuple[Floats, ...]
    effects: tuple[Effect, ...] = ()


@dataclass(frozen=True, eq=False)
class Model:
    """Records, their output groups, and the uncertain parameters of the system.

    injected: by record, values added in every simulation, see `InputDisturbance`.
    stepless: whether sensors report without the coarse quantization that an effect gives them.
    white: whether the noise is white, as in plain least squares; else it is a fitted autoregression.
    """

    system: System
    records: tuple[Record, ...]
    partition: CausalPartition
    known: list[Coordinate]
    injected: tuple[Mapping[str, Floats], ...] = field(default=())
    stepless: bool = False
    white: bool = False

    @once
    def measured(self) -> Series:
        """Recorded outputs, (T, m) by output group and record, in the unit of each output."""
        return [[_stack(b, r, None) for r in self.records] for b in self.partition.groups]

    @once
    def known_bins(self) -> Series:
        """1 for bins with recorded samples, 0 for others; (T, m) by output group and record."""
        return [
            [
                np.column_stack([r.sensors[o].known for o in b.outputs]).astype(float)
                for r in self.records
            ]
            for b in self.partition.groups
        ]

    @once
    def clocks(self) -> list[tuple[int, Coordinate]]:
        """Coordinates of clock offsets, each with its index."""
        return [(i, k) for i, k in enumerate(self.known) if k.of_clock]

    @once
    def coarse(self) -> "Model":
        """The same model with coarser integration steps, to compare simulations with each other."""
        model = self._like(replace(self, system=self.system.coarse()))
        model.__dict__["coarse"] = model
        return model

    @once
    def for_slopes(self) -> "Model":
        """The coarse model without rounding in sensors: a staircase has no useful derivative."""
        return self._like(replace(self.coarse, stepless=True))

    def _like(self, other: "Model") -> "Model":
        """Return another model of the same records, with shared measurements."""
        other.__dict__.update(measured=self.measured, known_bins=self.known_bins)
        return other

    def uncertain_of(self, known: list[Coordinate]) -> "Model":
        """Return the same model with only these parameters uncertain; coarse if this one is."""
        model = self._like(replace(self, known=known))
        if self.coarse is self:
            model.__dict__["coarse"] = model
        return model

    def with_noise(self, white: bool) -> "Model":
        """Return the same model with white noise, or with a fitted autoregression."""
        model = self._like(replace(self, white=white))
        if self.coarse is self:
            model.__dict__["coarse"] = model
        return model

    def until(self, share: float) -> "Model":
        """Return the same model with only the first share of each record counted as recorded.

        Tooth patterns always count completely.
        """
        shares = [share if group.order else 1.0 for group in self.partition.groups]
        known = [
            [k * (np.arange(len(k)) < part * len(k))[:, None] for k in ks]
            for part, ks in zip(shares, self.known_bins, strict=True)
        ]
        model = replace(self)
        model.__dict__.update(measured=self.measured, known_bins=known)
        if self.coarse is self:
            model.__dict__["coarse"] = model
        return model

    def origin(self) -> Point:
        """Return the prior mean: parameters as in the file, without slow disturbance."""
        slow = tuple(np.zeros(r.slow.shape[1]) for r in self.records)
        return Point(np.zeros(len(self.known)), slow)

    def at(self, point: Point) -> System:
        """Return the system at a point, effects of its file included."""
        system_effects = [e for e in point.effects if not isinstance(e, InputDisturbance)]
        return self.system.at(self.known, point.x, system_effects)

    def subsystems_changed_by(self, effect: Effect) -> tuple[str, ...]:
        """Return the subsystems whose outputs an effect can change."""
        if isinstance(effect, InputDisturbance):
            return (effect.subsystem,)
        return tuple(
            d for d in self.partition.subsystems if self.system.concerns(effect, self.partition, d)
        )

    def changes_only_sensors(self, effect: Effect) -> bool:
        """Return whether an effect leaves every simulation unchanged."""
        return not isinstance(effect, InputDisturbance) and self.system.changes_only_sensors(
            effect, self.partition
        )


def models(system: System, *sets: Sequence[Record]) -> list[Model]:
    """Return a model for each set of records, with the same partition and uncertain parameters."""
    together = [r for records in sets for r in records]
    partition = system.partition(together)
    known = system.coordinates(together, partition)
    return [Model(system, tuple(records), partition, known) for records in sets]


def simulation_input(
    model: Model,
    point: Point,
    record: int,
    subsystem: str,
    extra: Mapping[str, Floats] | None = None,
) -> SimulationInput:
    """Return the input of a simulation, with the injected waveforms and those of the effects.

    extra: further waveforms by name, SI, shape (rows,) each, see `SimulationInput.added`.
    """
    added: dict[str, Floats] = {}
    for waveforms in (*_disturbances(model, point, record), extra or {}):
        for name, waveform in waveforms.items():
            if not name.startswith(SENSOR):
                added[name] = added[name] + waveform if name in added else waveform
    return SimulationInput(
        model.records[record], model.partition, subsystem, point.q[record], added
    )


def _disturbances(model: Model, point: Point, record: int) -> list[Mapping[str, Floats]]:
    own = [e.waveforms[record] for e in point.effects if isinstance(e, InputDisturbance)]
    return [*model.injected[record : record + 1], *own]


def simulate(
    model: Model,
    point: Point,
    record: int,
    subsystem: str,
    extra: Mapping[str, Floats] | None = None,
    system: System | None = None,
) -> Columns:
    """Simulate one subsystem of one record; each column has shape (rows,).

    extra: values added to columns of the inputs, SI, shape (rows,) each.
    """
    simulated = model.at(point) if system is None else system
    return simulated.simulate(simulation_input(model, point, record, subsystem, extra))


def predict(
    model: Model,
    point: Point,
    subsystems: Iterable[str] | None = None,
    records: Iterable[int] | None = None,
    runs: Runs | None = None,
) -> Series:
    """Return the predicted outputs; output groups of other subsystems or records stay empty.

    (T, m) by output group and record, in the unit of each output. runs: simulations of this point,
    if there are any; new simulations are added.
    """
    system = model.at(point)
    effects = [e for e in system.effects if not (model.stepless and isinstance(e, Quantizes))]
    requested = set(model.partition.subsystems if subsystems is None else subsystems)
    predicted: Series = [[np.empty(0)] * len(model.records) for _ in model.partition.groups]
    for r in range(len(model.records)) if records is None else records:
        outs = {d: _run(model, point, r, d, runs, system) for d in requested}
        for b, group in enumerate(model.partition.groups):
            if group.subsystem in requested:
                record = model.records[r]
                outputs = _stack(
                    group,
                    record,
                    outs[group.subsystem],
                    effects,
                    clock_offsets(model, point, group),
                )
                misplace(outputs, group.outputs, record, system.effects)
                for waveforms in _disturbances(model, point, r):
                    _misread(outputs, group.outputs, record, waveforms)
                predicted[b][r] = outputs
    return predicted


def output_derivatives(
    model: Model, point: Point, system: System, group_index: int, record: int, run: Derivatives
) -> Floats:
    """Return derivatives of an output group in the directions of a run, (T, m, k)."""
    sensors, effects, clock_offsets = _sensors_of(model, point, system, group_index, record)
    slopes = [
        s.observe_derivatives(
            run.out, run.slopes, effects, clock_offsets.get(s.clock, 0.0), DIFFERENCE_STEP
        )
        for s in sensors
    ]
    return np.stack(slopes, axis=1)


def clock_derivatives(
    model: Model, point: Point, system: System, group_index: int, record: int, out: Columns
) -> dict[int, Floats]:
    """Return derivatives of an output group to each clock's coordinate, (T, m) by its index."""
    sensors, effects, clock_offsets = _sensors_of(model, point, system, group_index, record)
    slopes = {}
    for i, known in enumerate(model.known):
        if known.name in clock_offsets and known.of_clock:
            step = DIFFERENCE_STEP * known.slope(float(point.x[i]))
            shifted = {**clock_offsets, known.name: clock_offsets[known.name] + step}
            both = [
                np.column_stack([s.observe(out, effects, d.get(s.clock, 0.0)) for s in sensors])
                for d in (shifted, clock_offsets)
            ]
            slopes[i] = (both[0] - both[1]) / DIFFERENCE_STEP
    return slopes


def _sensors_of(
    model: Model, point: Point, system: System, group_index: int, record: int
) -> tuple[list[Sensor], list[Effect], dict[str, float]]:
    """Return the sensors of an output group, effects on them, and their clock offsets in s."""
    effects = [e for e in system.effects if not (model.stepless and isinstance(e, Quantizes))]
    group = model.partition.groups[group_index]
    sensors = [model.records[record].sensors[o] for o in group.outputs]
    return sensors, effects, clock_offsets(model, point, group)


def _run(
    model: Model, point: Point, record: int, subsystem: str, runs: Runs | None, system: System
) -> Columns:
    if runs is None:
        return simulate(model, point, record, subsystem, system=system)
    if (record, subsystem) not in runs:
        runs[record, subsystem] = simulate(model, point, record, subsystem, system=system)
    return runs[record, subsystem]


def clock_offsets(model: Model, point: Point, group: OutputGroup) -> dict[str, float]:
    """Return the offset of each uncertain clock, s; positive where it shows too much."""
    clocks = model.clocks if group.sensors_suspected else ()
    return {k.name: k.at(float(point.x[i])) for i, k in clocks}


def misplace(
    values: Floats, outputs: Iterable[str], record: Record, effects: Iterable[Effect]
) -> None:
    """Add the effect of displaced teeth to outputs (T, m)."""
    for effect in effects:
        if hasattr(effect, "tooth_offsets"):
            assert isinstance(effect, Misplaces)
            for j, output in enumerate(outputs):
                sensor = record.sensors[output]
                if sensor.offsets is not None and output.startswith(effect.encoder.split("_")[0]):
                    values[:, j] += sensor.misplaced(effect.tooth_offsets(sensor.offsets.shape[1]))


def _misread(
    values: Floats, outputs: Iterable[str], record: Record, waveforms: Mapping[str, Floats]
) -> None:
    """Add errors of sensors to outputs (T, m). waveforms: see `InputDisturbance`."""
    for j, output in enumerate(outputs):
        if at_sensor(output) in waveforms:
            values[:, j] += record.grid.binned(waveforms[at_sensor(output)])


def _stack(
    group: OutputGroup,
    record: Record,
    out: Columns | None,
    effects: Iterable[Effect] = (),
    clock_offsets: Mapping[str, float] = PUNCTUAL,
) -> Floats:
    """Stack the outputs of a group, (T, m): as recorded where no simulation is given."""
    sensors = [record.sensors[o] for o in group.outputs]
    return np.column_stack(
        [
            s.value if out is None else s.observe(out, effects, clock_offsets.get(s.clock, 0.0))
            for s in sensors
        ]
    )
