"""Simulation of one subsystem of one recording, with recorded signals and the slow road force."""

import threading
from collections.abc import Iterator, Mapping
from inspect import signature

import numpy as np

from slipbench.identification.mismatch.motorcycle.causal_cut import SERVO_SEAMS, changes_simulation
from slipbench.identification.mismatch.motorcycle.record import LEAD_IN, TRUE_SPEED
from slipbench.identification.mismatch.simulation.recent import Recent
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.plant.effects.effect import Effect
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.signals import FREE, Floats, Inputs, Outputs
from slipbench.plant.simulation import Simulation

SMOOTH = 50  # rows
STILL = 1e-4
"""Largest change of a throttle command at rest, as an opening: it is interpolated between frames."""
NO_ROAD: Floats = np.empty(0)
PASSES = 4
"""Iterations for a radius that depends on the speed."""
FINER = 2
"""Integration steps per row: with one, 4 mrad of backlash appear as 4.11."""
SERVO_STEPS = 4
"""Integration steps per row of the throttle servo alone, which costs a twentieth of the motion.

A command that changes between two steps acts over a whole step, with its mean. With one step a row
an acceleration limit of 250 1/s^2 was fitted 450 nats worse, and named a voltage limit.
"""


def steps_per_row(subsystem: str, finer: int, servo_steps: int = SERVO_STEPS) -> int:
    """Return the integration steps per row of a subsystem. finer: of the motion."""
    return servo_steps if subsystem == "servo" else finer


def simulate(bike: Motorcycle, given: SimulationInput) -> Outputs:
    """Simulate one subsystem of one record."""
    simulation, state, inputs = ready(bike, given)
    return simulation.advance(state, inputs)[1]


def observed(bike: Motorcycle, given: SimulationInput, finer: int) -> Mapping[str, Floats]:
    """Return the result of `simulate`, but only columns that sensors of the subsystem measure.

    By name, SI, shape (rows,) each. They are cached for other calls and must not be modified.
    finer: integration steps per row.
    """
    servo = given.subsystem == "servo"
    if servo and not given.added:
        return _servo(bike, given, given.observed)
    simulation, state, inputs = ready(bike, given, finer, servo)
    return simulation.trajectories(state, inputs, given.observed)


def ready(
    bike: Motorcycle,
    given: SimulationInput,
    finer: int = FINER,
    servo_only: bool = False,
    servo_steps: int = SERVO_STEPS,
) -> tuple[Simulation, Floats, Inputs]:
    """Return the simulation, its initial state and its inputs; they must not be modified.

    The initial state is that of `Simulation.state`, shape (size,). finer: integration steps per
    row, of the motion; servo_steps: of the throttle servo alone.
    """
    record = given.record
    step = record.grid.step
    steps = steps_per_row(given.subsystem, finer, servo_steps)
    simulation = _simulation(bike, step, steps, servo_only)
    warm_up = round(LEAD_IN / step)
    speed = true_speed(record, bike, warm_up + SMOOTH)
    table = _table(bike, given, smoothed(speed)[:warm_up])
    if given.added:
        table = table.copy()
    for name, waveform in given.added.items():
        table[:, Inputs.names.index(name)] += waveform
    inputs = Inputs(table)
    return simulation, _begin(simulation, inputs, record, speed), inputs


_LAST = threading.local()


def _simulation(bike: Motorcycle, step: float, finer: int, servo_only: bool) -> Simulation:
    """Return the simulation of a motorcycle; it is reused for its next recordings."""
    last: dict[bool, tuple[Motorcycle, Simulation]] = vars(_LAST).setdefault("made", {})
    if servo_only in last:
        owner, made = last[servo_only]
        if owner is bike and made.step == step / finer and made.every == finer:
            return made
    made = Simulation(bike, step / finer, finer, finer, servo_only=servo_only)
    last[servo_only] = bike, made
    return made


_TABLES: Recent[Floats] = Recent(3)
_SERVOS: Recent[Mapping[str, Floats]] = Recent(6)
_ERRORS: Recent[Floats] = Recent(6)


def _table(bike: Motorcycle, given: SimulationInput, initial_speed: Floats) -> Floats:
    """Inputs of a subsystem, by row; cached, not to be modified. initial_speed: of the warm-up."""
    record, drivers, q = given.record, given.drivers, given.q
    faulty = tuple(
        e for e in bike.effects if changes_simulation(e, given.partition, given.subsystem)
    )
    by_angle = any(e.unseen_turn for e in bike.effects)
    causes = (faulty, *_servo_parts(bike)) if faulty and drivers else None

    def make() -> Floats:
        table = _driven_inputs(record, drivers).copy()
        for source, column in drivers:
            if faulty:
                error = _sensor_error(bike, given, faulty, source)
                table[:, Inputs.names.index(column)] -= error
        inputs = Inputs(table)
        if q.size:
            inputs.road_force[:] += record.slow @ q
        inputs.measured_speed[: initial_speed.size] = initial_speed
        if by_angle:
            inputs.kept_rear_speed[:] = _recorded_wheel_speed(record)
        return table

    return _TABLES.of(
        record, (drivers, causes, q.tobytes(), initial_speed.tobytes(), by_angle), make
    )


def _recorded_wheel_speed(record: Record) -> Floats | float:
    """Recorded speed of the rear wheel in each row, rad/s; from its teeth if it has any."""
    if "rear_turned" in record.measured:
        angle = record.measured["rear_turned"]
        return np.diff(angle, prepend=2.0 * angle[0] - angle[1]) / record.grid.step
    return record.measured.get("rear", FREE)


def _sensor_error(
    bike: Motorcycle, given: SimulationInput, faulty: tuple[Effect, ...], source: str
) -> Floats:
    """Return the error of the signal that drives a subsystem, row by row.

    It is computed from the simulation that ends at the sensor, which only the throttle has.
    """
    record = given.record
    sensor = record.sensors[source]

    def make() -> Floats:
        out = _servo(bike, given, tuple(sorted(sensor.observation)))
        return sensor.error(out, faulty, record.time)

    return _ERRORS.of(record, (source, faulty, *_servo_parts(bike)), make)


def _servo(
    bike: Motorcycle, given: SimulationInput, columns: tuple[str, ...]
) -> Mapping[str, Floats]:
    """Outputs of the throttle servo for the recorded command; cached, not to be modified."""
    record = given.record

    def make() -> Mapping[str, Floats]:
        alone = SimulationInput(record, given.partition, "servo", NO_ROAD)
        simulation, state, inputs = ready(bike, alone, servo_only=True)
        return simulation.trajectories(state, inputs, columns)

    return _SERVOS.of(record, (columns, *_servo_parts(bike)), make)


def _servo_parts(bike: Motorcycle) -> tuple[object, ...]:
    """All parts of a motorcycle on which the motion of its throttle servo depends.

    The equations of the servo and the effects at their seams take nothing but these and the
    recorded command; a test checks this for every effect of the library.
    """
    acting = (e for e in bike.effects if any(hook.seam in SERVO_SEAMS for hook in e.hooks))
    return bike.throttle_servo, *acting


_LED: Recent[Floats] = Recent(3)


def _driven_inputs(record: Record, drivers: tuple[tuple[str, str], ...]) -> Floats:
    """Inputs of a record with the drivers of a subsystem; cached, not to be modified."""

    def make() -> Floats:
        table = record.inputs.copy()
        for source, column in drivers:
            table[:, Inputs.names.index(column)] = record.measured[source]
        return table

    return _LED.of(record, drivers, make)


def smoothed(speed: Floats) -> Floats:
    """Mean over 50 ms, the ends continued. speed: (rows,); gives (rows,)."""
    padded = np.pad(speed, SMOOTH // 2, mode="edge")
    sums = np.cumsum(np.concatenate(([0.0], padded)))
    return np.asarray((sums[SMOOTH:] - sums[:-SMOOTH]) / SMOOTH)


def true_speed(record: Record, bike: Motorcycle, rows: int) -> Floats:
    """Return the recorded speed that is nearest to the true speed, m/s, of the first rows.

    For a wheel it includes effects on the radius: a simulation with a wrong speed in its warm-up
    continues at a wrong speed.
    """
    for source in TRUE_SPEED:
        if source in record.measured:
            speed = record.measured[source][:rows]
            return rolling(record, bike, "front", speed) if source == "front" else speed
    if "rear" in record.measured:
        return rolling(record, bike, "rear", record.measured["rear"][:rows])
    ratio = bike.gears[int(Inputs(record.inputs).gear[0]) - 1]
    return rolling(record, bike, "rear", record.measured["engine_speed"][:rows] / ratio)


def rolling(record: Record, bike: Motorcycle, wheel: str, wheel_speed: Floats) -> Floats:
    """Return the speed at which a wheel rolls, m/s. wheel_speed: rad/s."""
    nominal: float = getattr(bike, f"{wheel}_wheel").radius
    hooks = [(e, h) for e in bike.effects for h in e.hooks if h.seam == f"{wheel}_radius"]
    speed = wheel_speed * nominal
    for _ in range(PASSES if hooks else 0):
        signals = {"speed": speed, "lean": Inputs(record.inputs).lean[: wheel_speed.size]}
        radius = np.full(wheel_speed.size, nominal)
        for effect, hook in hooks:
            own, *others = signature(hook.function).parameters
            values = [
                signals[name] if name in signals else getattr(effect, name) for name in others
            ]
            assert own == hook.seam
            radius = np.vectorize(hook.function, otypes=[np.float64])(radius, *values)
        speed = wheel_speed * radius
    return speed


def _begin(simulation: Simulation, inputs: Inputs, record: Record, speed: Floats) -> Floats:
    throttle, states = starts(simulation.motorcycle, inputs, record, speed)
    spark = float(inputs.spark[0])
    return simulation.state(throttle_command=throttle, spark=spark, throttle=throttle, **states)


def starts(
    bike: Motorcycle, inputs: Inputs, record: Record, speed: Floats
) -> tuple[float, dict[str, float]]:
    """Return the initial opening (0..1), and the other initial states that are not zero, SI.

    speed: recorded speed, m/s, shape (rows,), of which the mean of the first 20 rows is used.
    """
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
        **dict.fromkeys(_remembered_openings(bike), _at_rest(inputs, record)),
    }


def _remembered_openings(bike: Motorcycle) -> Iterator[str]:
    """Yield the states of effects that remember an opening."""
    for effect in bike.effects:
        for state, start in zip(effect.states, effect.starts, strict=False):
            if start == "throttle":
                yield f"{effect.name}.{state}"


def _at_rest(inputs: Inputs, record: Record) -> float:
    """Return the mean recorded opening once the servo has settled at the first command.

    In a trial of spark advance nothing moves the throttle: a servo with play stays where it is. The
    mean is taken, since a single reading is rounded.
    """
    recorded = record.measured.get("throttle_position", inputs.throttle_command)
    command = inputs.throttle_command[: round(LEAD_IN / record.grid.step)]
    moved = np.flatnonzero(np.abs(command - command[0]) > STILL)
    still = int(moved[0]) if moved.size else command.size
    return float(np.mean(recorded[still // 2 : still]))
