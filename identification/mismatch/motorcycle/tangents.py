"""Derivatives of one subsystem of one recording to vehicle parameters, in one simulation."""

from collections.abc import Sequence

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
from slipbench.identification.mismatch.simulation.coordinates import Coordinate
from slipbench.identification.mismatch.simulation.derivatives import Derivatives
from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.simulation.simulation_input import SimulationInput
from slipbench.plant.motorcycle import Motorcycle
from slipbench.plant.sensitivities import sensitivities
from slipbench.plant.signals import Floats, Inputs

SERVO_STEPS = 1
"""Integration steps per row of the throttle servo: its derivatives differ by 0.5 to 1.9 % (root mean
square) from those with four, and only direct the steps of a fit."""
SHARE = 1e-6
"""Finite-difference step for the initial state, as a share of the parameter."""
ROLLING = ("front_wheel", "rear_wheel", "gears")
"""Parts that determine the vehicle speed from the speeds of wheels and engine."""


def derivatives(
    bike: Motorcycle,
    given: SimulationInput,
    finer: int,
    known: Sequence[Coordinate],
    x: Floats,
    numbers: Sequence[int],
) -> Derivatives:
    """Simulate as `simulate.observed`, with derivatives to coordinates and the slow disturbance.

    bike: at the coordinates x of `known`, (n,); numbers: indices of the coordinates that act in
    this subsystem. The slow disturbance acts in the motion only. The derivatives of a column have
    shape (rows, directions).
    """
    record, servo = given.record, given.subsystem == "servo"
    simulation, state, inputs = ready(bike, given, finer, servo, SERVO_STEPS)
    parameters = [i for i in numbers if not known[i].of_clock]
    slow = 0 if servo else given.q.size
    states = np.zeros((len(simulation.layout.states), len(parameters) + slow))
    waveforms: dict[str, Floats] = {}
    if slow:
        waveforms["road_force"] = np.zeros((len(inputs.table), len(parameters) + slow))
        waveforms["road_force"][:, len(parameters) :] = record.slow
    for column, i in enumerate(parameters):
        initial, warm_up = _initial_derivatives(bike, record, inputs, known[i], float(x[i]))
        for name, slope in initial.items():
            states[simulation.layout.states.index(name), column] = slope
        if warm_up.any():
            waveform = waveforms.setdefault(
                "measured_speed", np.zeros((len(inputs.table), len(states[0])))
            )
            waveform[: warm_up.size, column] = warm_up
    names = {_parameter(known[i]): column for column, i in enumerate(parameters)}
    out, slopes = sensitivities(simulation, state, inputs, given.observed, names, states, waveforms)
    scale = np.ones(len(parameters) + slow)
    scale[: len(parameters)] = [_per_coordinate(bike, known[i], float(x[i])) for i in parameters]
    for rows in slopes.values():
        rows *= scale
    return Derivatives(out, slopes, tuple(parameters), slow)


def _parameter(coordinate: Coordinate) -> str:
    """Name of a coordinate's parameter in the simulation."""
    if coordinate.owner == "gears":
        return coordinate.key
    return f"{coordinate.owner}_{coordinate.name}"


def _per_coordinate(bike: Motorcycle, coordinate: Coordinate, x: float) -> float:
    """Derivative of the parameter to its coordinate; zero at the end of its range."""
    value = coordinate.at(x)
    return coordinate.slope(x) if _changed(bike, coordinate, value)[1] == value else 0.0


def _changed(bike: Motorcycle, coordinate: Coordinate, value: float) -> tuple[Motorcycle, float]:
    """The motorcycle with another value of a parameter, and that value, limited to its range."""
    shifted = Coordinate(coordinate.owner, coordinate.name, value, 0.0, linear=True)
    new = motorcycle_at(bike, [shifted], np.zeros(1))
    if coordinate.owner == "gears":
        return new, new.gears[int(coordinate.name) - 1]
    return new, float(getattr(getattr(new, coordinate.owner), coordinate.name))


def _initial_derivatives(
    bike: Motorcycle, record: Record, inputs: Inputs, coordinate: Coordinate, x: float
) -> tuple[dict[str, float], Floats]:
    """Derivatives of initial states and of the speed in the warm-up to a parameter."""
    value = coordinate.at(x)
    ends = [_changed(bike, coordinate, value * (1.0 + s)) for s in (SHARE, -SHARE)]
    step = ends[0][1] - ends[1][1]
    if step == 0.0:
        return {}, np.zeros(0)
    rows = round(LEAD_IN / record.grid.step)
    speeds = [true_speed(record, bike, rows + SMOOTH)] * 2
    if coordinate.owner in ROLLING:
        speeds = [true_speed(record, shifted, rows + SMOOTH) for shifted, _ in ends]
    up, down = (
        starts(shifted, inputs, record, speed)[1]
        for (shifted, _), speed in zip(ends, speeds, strict=True)
    )
    states = {name: (up[name] - down[name]) / step for name in up if up[name] != down[name]}
    warm_up = (smoothed(speeds[0]) - smoothed(speeds[1]))[:rows] / step
    return states, warm_up if coordinate.owner in ROLLING else np.zeros(0)
