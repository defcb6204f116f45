"""One drive of one recording, simulated: led by what was recorded, pushed by the slow road."""

from collections.abc import Mapping

import numpy as np

from identification.mismatch.blocks import Chain
from identification.mismatch.motorcycle.record import LEAD_IN, TRUE_SPEED
from identification.mismatch.record import Record
from plant.motorcycle import Motorcycle
from plant.signals import Floats, Inputs, Outputs
from plant.simulation import Simulation

SMOOTH = 50  # rows
FINER = 2
"""Steps of integration in a row."""


def simulate(
    bike: Motorcycle, record: Record, chain: Chain, drive: str, q: Floats,
    added: Mapping[str, Floats],
) -> Outputs:  # fmt: skip
    """Run one drive of one record. q: of the slow road; added: to columns of the inputs."""
    step = record.grid.step
    simulation = Simulation(bike, step / FINER, FINER, FINER)
    table = record.inputs.copy()
    inputs = Inputs(table)
    inputs.road_force[:] += record.slow @ q
    for name, course in added.items():
        table[:, Inputs.names.index(name)] += course
    for source, column in chain.drives[drive]:
        table[:, Inputs.names.index(column)] = record.measured[source]
    speed = true_speed(record, bike)
    settling = round(LEAD_IN / step)
    inputs.measured_speed[:settling] = _smoothed(speed[: settling + SMOOTH])[:settling]
    return simulation.advance(_begin(simulation, inputs, record, speed), inputs)[1]


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
    ratio = bike.gears[int(Inputs(record.inputs).gear[0]) - 1]
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
