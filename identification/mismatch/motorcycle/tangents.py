"""Derivatives of one drive of one recording to the numbers of a vehicle, in one simulation."""

from collections.abc import Mapping, Sequence

import numpy as np

from slipbench.identification.mismatch.motorcycle.coordinates import motorcycle_at
from slipbench.identification.mismatch.motorcycle.record import LEAD_IN
from slipbench.identification.mismatch.motorcycle.simulate import (
    SMOOTH,
    ready,
    smoothed,
    starts,
    true_speed,
)
from slipbench.identification.mismatch.simulation.causal_partition import CausalPartition
from slipbench.identification.mismatch.simulation.coordinates import Coordinate
from slipbench.identification.mismatch.simulation.derivatives import Derivatives
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.sensitivities import sensitivities
from slipbench.plant.signals import Floats, Inputs

SHARE = 1e-6
"""Of a number, by which it is changed to see what the beginning of a simulation makes of it."""
ROLLING = ("front_wheel", "rear_wheel", "gears")
"""Parts that decide at which speed the motorcycle rolls, given what its wheels turn."""


def derivatives(
    bike: Motorcycle,
    record: Record,
    partition: CausalPartition,
    subsystem: str,
    q: Floats,
    added: Mapping[str, Floats],
    finer: int,
    known: Sequence[Coordinate],
    x: Floats,
    numbers: Sequence[int],
) -> Derivatives:
    """Simulate as `simulate.shown` does, with derivatives to coordinates and the slow unknown.

    bike: at the coordinates x of what is known; numbers: of the coordinates that act in this drive.
    The slow unknown acts in the motion alone.
    """
    simulation, state, inputs = ready(
        bike, record, partition, subsystem, q, added, finer, servo_only=subsystem == "servo"
    )
    moving = [i for i in numbers if not known[i].of_clock]
    slow = 0 if subsystem == "servo" else q.size
    states = np.zeros((len(simulation.layout.states), len(moving) + slow))
    courses: dict[str, Floats] = {}
    if slow:
        courses["road_force"] = np.zeros((len(inputs.table), len(moving) + slow))
        courses["road_force"][:, len(moving) :] = record.slow
    for column, i in enumerate(moving):
        begun, lead = _beginning(bike, record, inputs, known[i], float(x[i]))
        for name, slope in begun.items():
            states[simulation.layout.states.index(name), column] = slope
        if lead.any():
            course = courses.setdefault(
                "measured_speed", np.zeros((len(inputs.table), len(states[0])))
            )
            course[: lead.size, column] = lead
    names = {_parameter(known[i]): column for column, i in enumerate(moving)}
    outputs = [
        o for block in partition.groups if block.subsystem == subsystem for o in block.outputs
    ]
    wanted = sorted({column for o in outputs for column in record.sensors[o].observation})
    out, slopes = sensitivities(simulation, state, inputs, wanted, names, states, courses)
    scale = np.ones(len(moving) + slow)
    scale[: len(moving)] = [_per_coordinate(bike, known[i], float(x[i])) for i in moving]
    for rows in slopes.values():
        rows *= scale
    return Derivatives(out, slopes, tuple(moving), slow)


def _parameter(coordinate: Coordinate) -> str:
    """The name of a coordinate's parameter in the simulation."""
    if coordinate.owner == "gears":
        return coordinate.key
    return f"{coordinate.owner}_{coordinate.name}"


def _per_coordinate(bike: Motorcycle, coordinate: Coordinate, x: float) -> float:
    """How fast the parameter changes with its coordinate; zero at the end of its range."""
    value = coordinate.at(x)
    return coordinate.slope(x) if _changed(bike, coordinate, value)[1] == value else 0.0


def _changed(bike: Motorcycle, coordinate: Coordinate, value: float) -> tuple[Motorcycle, float]:
    """The motorcycle with another value of a parameter, and that value, kept inside its range."""
    there = Coordinate(coordinate.owner, coordinate.name, value, 0.0, linear=True)
    new = motorcycle_at(bike, [there], np.zeros(1))
    if coordinate.owner == "gears":
        return new, new.gears[int(coordinate.name) - 1]
    return new, float(getattr(getattr(new, coordinate.owner), coordinate.name))


def _beginning(
    bike: Motorcycle, record: Record, inputs: Inputs, coordinate: Coordinate, x: float
) -> tuple[dict[str, float], Floats]:
    """How states at the beginning and the speed that leads in change with a parameter."""
    value = coordinate.at(x)
    ends = [_changed(bike, coordinate, value * (1.0 + s)) for s in (SHARE, -SHARE)]
    by = ends[0][1] - ends[1][1]
    if by == 0.0:
        return {}, np.zeros(0)
    rows = round(LEAD_IN / record.grid.step)
    speeds = [true_speed(record, bike, rows + SMOOTH)] * 2
    if coordinate.owner in ROLLING:
        speeds = [true_speed(record, there, rows + SMOOTH) for there, _ in ends]
    up, down = (
        starts(there, inputs, record, speed)[1]
        for (there, _), speed in zip(ends, speeds, strict=True)
    )
    states = {name: (up[name] - down[name]) / by for name in up if up[name] != down[name]}
    lead = (smoothed(speeds[0]) - smoothed(speeds[1]))[:rows] / by
    return states, lead if coordinate.owner in ROLLING else np.zeros(0)
