"""What a push at a place does: the answer of all outputs to it.

A push is a force or torque for one bin of time, at one moment of every recording; the answer of the
fitted simulation to it, convolved with any course of pushes, is what that course would leave in the
outputs. That is linear, and accurate to some per cent: enough to say where and along what.
"""

import numpy as np
from scipy import signal

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.model import Runs, Series, simulate
from slipbench.identification.mismatch.simulation.sensor import Columns
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

AT = 5 / 6
"""When a push is made, in stretches since the simulation's start."""


def places(fit: Fit) -> list[InjectionPoint]:
    """Places where something may act that these recordings can see; sensors aside."""
    return fit.model.system.places(fit.model.partition)


def answers(fit: Fit, place: InjectionPoint, plain: Runs) -> Series:
    """Answer of all outputs to a push in one bin, by block and record: (memory, m); else empty.

    plain: simulations without a push, if there are any; those made here are added.
    """
    model = fit.model
    found: Series = [[np.empty(0)] * len(model.records) for _ in model.partition.groups]
    for r in range(len(model.records)):
        for b, one in _answer(fit, place, r, plain).items():
            found[b][r] = one
    return found


def _answer(fit: Fit, place: InjectionPoint, r: int, plain: Runs) -> dict[int, Floats]:
    model = fit.model
    grid = model.records[r].grid
    lead = round(grid.start / grid.width)
    first = round((grid.start + AT * grid.stretch) / grid.width)
    pulse = np.zeros(grid.rows)
    per = grid.rows_per_bin
    pulse[first * per : (first + 1) * per] = place.size
    if (r, place.subsystem) not in plain:
        plain[r, place.subsystem] = simulate(
            model, fit.point, r, place.subsystem, {}, model.at(fit.point)
        )
    size = place.size
    try:
        pushed = _pushed(fit, place, r, pulse)
    except PlantError:  # beyond what the simulation accepts: it is pushed the other way
        size, pushed = -size, _pushed(fit, place, r, -pulse)
    skip, length = first - lead, round(grid.stretch / grid.width)
    return {
        b: _seen(fit, b, r, pushed, plain[r, place.subsystem])[skip : skip + length] / size
        for b, block in enumerate(model.partition.groups)
        if block.subsystem == place.subsystem and block.order
    }


def _pushed(fit: Fit, place: InjectionPoint, r: int, pulse: Floats) -> Columns:
    system = fit.model.at(fit.point)
    injected = system.input_disturbance(place, fit.model.records[r], pulse)
    return simulate(fit.model, fit.point, r, place.subsystem, injected, system)


def _seen(fit: Fit, b: int, r: int, pushed: Columns, plain: Columns) -> Floats:
    record, block = fit.model.records[r], fit.model.partition.groups[b]
    sensors = [record.sensors[o] for o in block.outputs]
    return np.column_stack([s.observe(pushed) - s.observe(plain) for s in sensors])


def respond(answer: Floats, courses: Floats) -> Floats:
    """Answer to courses (T, k), one value a bin: (T, m, k)."""
    full = signal.fftconvolve(courses[:, None, :], answer[:, :, None], axes=0)
    return np.asarray(full[: len(courses)])
