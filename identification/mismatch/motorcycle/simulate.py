"""One drive of one recording, simulated: led by what was recorded, pushed by the slow road."""

import threading
from collections.abc import Mapping
from inspect import signature

import numpy as np

from slipbench.identification.mismatch.motorcycle.causal_cut import SERVO_SEAMS, changes_simulation
from slipbench.identification.mismatch.motorcycle.record import LEAD_IN, TRUE_SPEED
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.recent import Recent
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.plant.effects.effect import Effect
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import FREE, Floats, Inputs, Outputs
from slipbench.plant.simulation import Simulation

SMOOTH = 50  # rows
NO_ROAD: Floats = np.empty(0)
PASSES = 4
"""How often a radius that depends on the speed is taken anew."""
FINER = 2
"""Steps of integration in a row: with one, 4 mrad of backlash look like 4.11."""


def simulate(
    bike: Motorcycle,
    record: Record,
    partition: CausalPartition,
    subsystem: str,
    q: Floats,
    added: Mapping[str, Floats],
) -> Outputs:
    """Run one drive of one record. q: of the slow road; added: to columns of the inputs."""
    simulation, state, inputs = ready(bike, record, partition, subsystem, q, added)
    return simulation.advance(state, inputs)[1]


def shown(
    bike: Motorcycle,
    record: Record,
    partition: CausalPartition,
    subsystem: str,
    q: Floats,
    added: Mapping[str, Floats],
    finer: int,
) -> Mapping[str, Floats]:
    """Return what `simulate` gives, but only the columns that sensors of this drive look at.

    They may be kept for other calls: not to be written.
    """
    outputs = [
        o for block in partition.groups if block.subsystem == subsystem for o in block.outputs
    ]
    wanted = tuple(sorted({column for o in outputs for column in record.sensors[o].observation}))
    if subsystem == "servo" and not added:
        return _servo(bike, record, partition, finer, wanted)
    simulation, state, inputs = ready(
        bike, record, partition, subsystem, q, added, finer, subsystem == "servo"
    )
    return simulation.trajectories(state, inputs, wanted)


def ready(
    bike: Motorcycle,
    record: Record,
    partition: CausalPartition,
    subsystem: str,
    q: Floats,
    added: Mapping[str, Floats],
    finer: int = FINER,
    servo_only: bool = False,
) -> tuple[Simulation, Floats, Inputs]:
    """Return the simulation, its state at the beginning, and what drives it; not to be written."""
    step = record.grid.step
    simulation = _simulation(bike, step, finer, servo_only)
    settling = round(LEAD_IN / step)
    speed = true_speed(record, bike, settling + SMOOTH)
    table = _table(bike, record, partition, subsystem, q, smoothed(speed)[:settling], finer)
    if added:
        table = table.copy()
    for name, course in added.items():
        table[:, Inputs.names.index(name)] += course
    inputs = Inputs(table)
    return simulation, _begin(simulation, inputs, record, speed), inputs


_LAST = threading.local()


def _simulation(bike: Motorcycle, step: float, finer: int, servo_only: bool) -> Simulation:
    """Return the simulation of a motorcycle: one for all its recordings, which follow each other."""
    last: dict[bool, tuple[Motorcycle, Simulation]] = vars(_LAST).setdefault("made", {})
    if servo_only in last:
        of, made = last[servo_only]
        if of is bike and made.step == step / finer and made.every == finer:
            return made
    made = Simulation(bike, step / finer, finer, finer, servo_only=servo_only)
    last[servo_only] = bike, made
    return made


_TABLES: Recent[Floats] = Recent(3)
_SERVOS: Recent[Mapping[str, Floats]] = Recent(6)
_ERRORS: Recent[Floats] = Recent(6)


def _table(
    bike: Motorcycle,
    record: Record,
    partition: CausalPartition,
    subsystem: str,
    q: Floats,
    lead: Floats,
    finer: int,
) -> Floats:
    """Inputs of a drive, row by row. lead: the speed that leads it in; kept, not to be written."""
    leads = partition.subsystems[subsystem]
    wrong = tuple(e for e in bike.effects if changes_simulation(e, partition, subsystem))
    turning = any(e.unseen_turn for e in bike.effects)
    by = (wrong, *_servo_parts(bike), finer) if wrong and leads else None

    def make() -> Floats:
        table = _led(record, leads).copy()
        for source, column in leads:
            if wrong:
                told = _told_too_much(bike, record, partition, wrong, source, finer)
                table[:, Inputs.names.index(column)] -= told
        inputs = Inputs(table)
        if q.size:
            inputs.road_force[:] += record.slow @ q
        inputs.measured_speed[: lead.size] = lead
        if turning:
            inputs.kept_rear_speed[:] = _recorded_turning(record)
        return table

    return _TABLES.of(record, (leads, by, q.tobytes(), lead.tobytes(), turning), make)


def _recorded_turning(record: Record) -> Floats | float:
    """Speed at which the rear wheel turned in each row, rad/s; from its teeth if it has any."""
    if "rear_turned" in record.measured:
        turned = record.measured["rear_turned"]
        return np.diff(turned, prepend=2.0 * turned[0] - turned[1]) / record.grid.step
    return record.measured.get("rear", FREE)


def _told_too_much(
    bike: Motorcycle,
    record: Record,
    partition: CausalPartition,
    wrong: tuple[Effect, ...],
    source: str,
    finer: int,
) -> Floats:
    """Return what wrong sensors add to the signal that leads a drive, row by row.

    The simulation that leads up to the sensor tells it; there is one for the throttle alone.
    """
    sensor = record.sensors[source]

    def make() -> Floats:
        out = _servo(bike, record, partition, finer, tuple(sorted(sensor.observation)))
        return sensor.error(out, wrong, record.time)

    return _ERRORS.of(record, (source, wrong, *_servo_parts(bike), finer), make)


def _servo(
    bike: Motorcycle,
    record: Record,
    partition: CausalPartition,
    finer: int,
    columns: tuple[str, ...],
) -> Mapping[str, Floats]:
    """Some outputs of the throttle servo under the recorded command; kept, not to be written."""

    def make() -> Mapping[str, Floats]:
        simulation, state, inputs = ready(
            bike, record, partition, "servo", NO_ROAD, {}, finer, True
        )
        return simulation.trajectories(state, inputs, columns)

    return _SERVOS.of(record, (columns, *_servo_parts(bike), finer), make)


def _servo_parts(bike: Motorcycle) -> tuple[object, ...]:
    """Everything of a motorcycle on which the motion of its throttle servo depends.

    The equations of the servo and the effects at their seams take nothing but these and the
    recorded command: a law that `tests` states for every effect of the library.
    """
    acting = (e for e in bike.effects if any(hook.seam in SERVO_SEAMS for hook in e.hooks))
    return bike.throttle_servo, *acting


_LED: Recent[Floats] = Recent(3)


def _led(record: Record, leads: tuple[tuple[str, str], ...]) -> Floats:
    """Inputs of a record with the measured signals that lead a drive; kept, not to be written."""

    def make() -> Floats:
        table = record.inputs.copy()
        for source, column in leads:
            table[:, Inputs.names.index(column)] = record.measured[source]
        return table

    return _LED.of(record, leads, make)


def smoothed(speed: Floats) -> Floats:
    """Mean over 50 ms, the ends continued. speed: (rows,); gives (rows,)."""
    padded = np.pad(speed, SMOOTH // 2, mode="edge")
    sums = np.cumsum(np.concatenate(([0.0], padded)))
    return np.asarray((sums[SMOOTH:] - sums[:-SMOOTH]) / SMOOTH)


def true_speed(record: Record, bike: Motorcycle, rows: int) -> Floats:
    """Return the recorded speed that comes nearest to the true one, m/s, of the first rows.

    A wheel's is that of its radius as the effects of the motorcycle have it: a simulation that is
    led in at a wrong speed goes on at a wrong speed.
    """
    for source in TRUE_SPEED:
        if source in record.measured:
            seen = record.measured[source][:rows]
            return rolling(record, bike, "front", seen) if source == "front" else seen
    if "rear" in record.measured:
        return rolling(record, bike, "rear", record.measured["rear"][:rows])
    ratio = bike.gears[int(Inputs(record.inputs).gear[0]) - 1]
    return rolling(record, bike, "rear", record.measured["engine_speed"][:rows] / ratio)


def rolling(record: Record, bike: Motorcycle, wheel: str, turning: Floats) -> Floats:
    """Return the speed at which a wheel rolls, m/s. turning: rad/s."""
    nominal: float = getattr(bike, f"{wheel}_wheel").radius
    hooks = [(e, h) for e in bike.effects for h in e.hooks if h.seam == f"{wheel}_radius"]
    speed = turning * nominal
    for _ in range(PASSES if hooks else 0):
        seen = {"speed": speed, "lean": Inputs(record.inputs).lean[: turning.size]}
        radius = np.full(turning.size, nominal)
        for effect, hook in hooks:
            own, *others = signature(hook.function).parameters
            told = [seen[name] if name in seen else getattr(effect, name) for name in others]
            assert own == hook.seam
            radius = np.vectorize(hook.function, otypes=[np.float64])(radius, *told)
        speed = turning * radius
    return speed


def _begin(simulation: Simulation, inputs: Inputs, record: Record, speed: Floats) -> Floats:
    throttle, states = starts(simulation.motorcycle, inputs, record, speed)
    spark = float(inputs.spark[0])
    return simulation.state(throttle_command=throttle, spark=spark, throttle=throttle, **states)


def starts(
    bike: Motorcycle, inputs: Inputs, record: Record, speed: Floats
) -> tuple[float, dict[str, float]]:
    """Opening (0..1) at the beginning, and the other states that are not zero."""
    v = float(np.mean(speed[:20]))
    gear = max(int(inputs.gear[0]), 1)
    rear = v / bike.rear_wheel.radius * 1.01
    drag = 0.5 * bike.body.air_density * bike.body.drag_area * v * v + 30.0
    throttle = float(record.measured.get("throttle_position", inputs.throttle_command)[0])
    return throttle, {
        "air": throttle,
        "engine_speed": rear * bike.gears[gear - 1],
        "rear_speed": rear,
        "speed": v,
        "crank_angle": record.turned,
        "twist": drag * bike.rear_wheel.radius / bike.driveline.stiffness,
    }
