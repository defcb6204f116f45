"""The simulation put beside the recordings: from coordinates and effects to what sensors show."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from identification.mismatch.blocks import Block, Chain, chain
from identification.mismatch.coordinates import Coordinate, coordinates, motorcycle_at
from identification.mismatch.record import LEAD_IN, TRUE_SPEED, Record
from identification.mismatch.sampling import STEP
from identification.mismatch.slow_road import road_hats
from plant.effects.effect import Effect
from plant.encoder import Misplaces
from plant.motorcycle import Motorcycle
from plant.signals import Floats, Inputs, Outputs
from plant.simulation import Simulation
from plant.vehicle_file import Vehicle

SMOOTH = 50  # rows
FINER = 2
"""Steps of integration in a row."""
Series = list[list[Floats]]
"""By block and record: (T, m)."""


@dataclass(frozen=True)
class Point:
    """Where the model stands. x: coordinates of the vehicle; q: road by record; effects."""

    x: Floats
    q: tuple[Floats, ...]
    effects: tuple[Effect, ...] = ()


@dataclass(frozen=True, eq=False)
class Model:
    """Records, the blocks they carry, and what is uncertain of the vehicle.

    injected: by record, columns of the inputs to which something is added at every simulation.
    """

    vehicle: Vehicle
    records: tuple[Record, ...]
    chain: Chain
    known: list[Coordinate]
    injected: tuple[Mapping[str, Floats], ...] = field(default=())

    @cached_property
    def hats(self) -> tuple[Floats, ...]:
        """Forces of the slow road, by record."""
        mass = self.vehicle.motorcycle.body.mass
        return tuple(road_hats(r.grid.rows, mass) for r in self.records)

    @cached_property
    def measured(self) -> Series:
        """What was recorded."""
        return [[_stack(b, r, None) for r in self.records] for b in self.chain.blocks]

    @cached_property
    def known_bins(self) -> Series:
        """1 where something was recorded, 0 elsewhere."""
        return [
            [np.column_stack([r.sensors[o].known for o in b.outputs]).astype(float)
             for r in self.records] for b in self.chain.blocks
        ]  # fmt: skip

    def origin(self) -> Point:
        """Return the vehicle as its file tells it, on a road without wind."""
        return Point(np.zeros(len(self.known)), tuple(np.zeros(h.shape[1]) for h in self.hats))


def models(vehicle: Vehicle, *sets: Sequence[Record]) -> list[Model]:
    """Put a vehicle beside sets of recordings, cut alike and with the same uncertain numbers."""
    ready = [r for records in sets for r in records]
    cut = chain(ready)
    gears = {int(g) for r in ready for g in np.unique(r.inputs.gear) if g > 0}
    clocks = {
        r.sensors[o].clock
        for r in ready for b in cut.blocks if b.drive == "motion" and b.order for o in b.outputs
    }  # fmt: skip
    reference = "ecu" if "ecu" in clocks else min(clocks, default="")
    known = coordinates(vehicle, gears, clocks - {reference})
    return [Model(vehicle, tuple(records), cut, known) for records in sets]


def motorcycle(model: Model, point: Point) -> Motorcycle:
    """Return the motorcycle that a point describes, effects of the vehicle file included."""
    base = motorcycle_at(model.vehicle.motorcycle, model.known, point.x)
    new = {e.key for e in point.effects}
    kept = tuple(e for e in base.effects if e.key not in new)
    return replace(base, effects=(*kept, *point.effects))


def simulate(
    model: Model, bike: Motorcycle, record: int, drive: str, q: Floats,
    extra: Mapping[str, Floats] | None = None,
) -> Outputs:  # fmt: skip
    """Run one drive of one record. extra: what is added to columns of the inputs."""
    ready = model.records[record]
    simulation = Simulation(bike, STEP / FINER, FINER, FINER)
    table = ready.inputs.table.copy()
    inputs = Inputs(table)
    inputs.road_force[:] += model.hats[record] @ q
    for added in (model.injected[record] if model.injected else {}, extra or {}):
        for name, course in added.items():
            table[:, Inputs.names.index(name)] += course
    for source, column in model.chain.drives[drive]:
        table[:, Inputs.names.index(column)] = ready.measured[source]
    speed = true_speed(ready, bike)
    settling = round(LEAD_IN / STEP)
    inputs.measured_speed[:settling] = _smoothed(speed[: settling + SMOOTH])[:settling]
    return simulation.advance(_begin(simulation, inputs, ready, speed), inputs)[1]


def _smoothed(speed: Floats) -> Floats:
    """Mean over 50 ms, the ends continued."""
    padded = np.pad(speed, SMOOTH // 2, mode="edge")
    sums = np.cumsum(np.concatenate(([0.0], padded)))
    return np.asarray((sums[SMOOTH:] - sums[:-SMOOTH]) / SMOOTH)


def true_speed(record: Record, bike: Motorcycle) -> Floats:
    """Return the recorded speed that comes nearest to the true one, m/s."""
    for source in TRUE_SPEED:
        if source in record.measured:
            factor = bike.front_wheel.radius if source == "front" else 1.0
            return record.measured[source] * factor
    if "rear" in record.measured:
        return record.measured["rear"] * bike.rear_wheel.radius
    ratio = bike.gears[int(record.inputs.gear[0]) - 1]
    return record.measured["engine_speed"] / ratio * bike.rear_wheel.radius


def _begin(simulation: Simulation, inputs: Inputs, record: Record, speed: Floats) -> Floats:
    bike = simulation.motorcycle
    v = float(np.mean(speed[:20]))
    gear = max(int(inputs.gear[0]), 1)
    rear = v / bike.rear_wheel.radius * 1.01
    drag = 0.5 * bike.body.air_density * bike.body.drag_area * v * v + 30.0
    throttle = float(record.measured.get("throttle_position", inputs.throttle_command)[0])
    return simulation.state(
        throttle=throttle, air=throttle, throttle_command=throttle, spark=float(inputs.spark[0]),
        engine_speed=rear * bike.gears[gear - 1], rear_speed=rear, speed=v,
        twist=drag * bike.rear_wheel.radius / bike.driveline.stiffness,
    )  # fmt: skip


def predict(
    model: Model,
    point: Point,
    drives: Iterable[str] | None = None,
    records: Iterable[int] | None = None,
) -> Series:
    """Return what the sensors would show; blocks of other drives or records are left empty."""
    bike = motorcycle(model, point)
    wanted = set(model.chain.drives if drives is None else drives)
    found: Series = [[np.empty(0)] * len(model.records) for _ in model.chain.blocks]
    for r in range(len(model.records)) if records is None else records:
        outs = {d: simulate(model, bike, r, d, point.q[r]) for d in wanted}
        for b, block in enumerate(model.chain.blocks):
            if block.drive in wanted:
                seen = _stack(block, model.records[r], outs[block.drive], bike.effects)
                found[b][r] = _shown(model, point, block, r, seen, bike)
    return found


def _shown(
    model: Model, point: Point, block: Block, r: int, seen: Floats, bike: Motorcycle
) -> Floats:
    """Add what clocks and tooth errors do."""
    record = model.records[r]
    for i, coordinate in enumerate(model.known):
        if coordinate.owner == "clock" and block.drive == "motion" and block.order:
            late = coordinate.at(float(point.x[i]))
            for j, output in enumerate(block.outputs):
                if late and record.sensors[output].clock == coordinate.name:
                    seen[:, j] -= late * np.gradient(seen[:, j], record.grid.width)
    misplace(seen, block.outputs, record, bike.effects)
    return seen


def misplace(
    seen: Floats, outputs: Iterable[str], record: Record, effects: Iterable[Effect]
) -> None:
    """Add to outputs (T, m) what displaced teeth make of them."""
    for effect in effects:
        if isinstance(effect, Misplaces):
            for j, output in enumerate(outputs):
                sensor = record.sensors[output]
                if sensor.offsets is not None and output.startswith(effect.encoder.split("_")[0]):
                    seen[:, j] += sensor.misplaced(effect.tooth_offsets(sensor.offsets.shape[1]))


def _stack(
    block: Block, record: Record, out: Outputs | None, effects: Iterable[Effect] = ()
) -> Floats:
    sensors = [record.sensors[o] for o in block.outputs]
    return np.column_stack([s.value if out is None else s.look(out, effects) for s in sensors])
