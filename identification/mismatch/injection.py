"""Where something may act: a push there, answered by all outputs.

A push is a force or torque for one bin of time, at one moment of every recording; the answer of the
fitted simulation to it, convolved with any course of pushes, is what that course would leave in the
outputs. That is linear, and accurate to some per cent: enough to say where and along what.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import signal

from identification.mismatch.fitting import Fit
from identification.mismatch.model import motorcycle, simulate
from identification.mismatch.record import BIN
from identification.mismatch.sampling import STEP
from plant.signals import Floats, Inputs, Outputs

MEMORY = 3.0  # s, after which a push is forgotten (the slow road tells the rest)
AT = 2.5  # s since the simulation's start


@dataclass(frozen=True)
class Injection:
    """A place. drive: where it acts; push: inputs and their size per unit, SI.

    The wheel's torque is pushed through the rear brake, with its sign. over_ratio: the crank's
    part is divided by the gear. over_radius: the wheel's part is multiplied by the rolling radius.
    """

    name: str
    block: str
    unit: str
    size: float
    drive: str
    push: Mapping[str, float]
    over_ratio: bool = False
    over_radius: bool = False


PLACES = (
    Injection("servo force", "throttle_servo", "1", 0.01, "servo", {"throttle_command": 1.0}),
    Injection("engine torque", "engine", "N m", 5.0, "motion", {"engine_disturbance": 1.0}),
    Injection("driveline torque", "driveline", "N m", 40.0, "motion",
              {"engine_disturbance": -1.0, "rear_brake": -1.0}, over_ratio=True),
    Injection("tyre force", "tyre", "N", 100.0, "motion",
              {"rear_brake": 1.0, "road_force": 1.0}, over_radius=True),
    Injection("wheel torque", "rear_wheel", "N m", 20.0, "motion", {"rear_brake": -1.0}),
    Injection("road force", "body", "N", 60.0, "motion", {"road_force": 1.0}),
)  # fmt: skip


def places(fit: Fit) -> list[Injection]:
    """Places where something may act that these recordings can see."""
    return [p for p in PLACES if p.drive in fit.model.chain.drives]


def answers(fit: Fit, place: Injection) -> list[list[Floats]]:
    """Answer of all outputs to a push in one bin, by block and record: (memory, m); else empty."""
    model = fit.model
    found = [[np.empty(0)] * len(model.records) for _ in model.chain.blocks]
    for r in range(len(model.records)):
        for b, one in _answer(fit, place, r).items():
            found[b][r] = one
    return found


def _answer(fit: Fit, place: Injection, r: int) -> dict[int, Floats]:
    model, bike = fit.model, motorcycle(fit.model, fit.point)
    record = model.records[r]
    rows = record.grid.rows
    first = round((record.grid.start + AT) / BIN)
    pulse = np.zeros(rows)
    pulse[round(first * BIN / STEP) : round((first + 1) * BIN / STEP)] = place.size
    injected = injection_columns(
        place, pulse, bike.gears[int(record.inputs.gear[0]) - 1], bike.rear_wheel.radius
    )
    pushed, plain = (
        simulate(model, bike, r, place.drive, fit.point.q[r], extra) for extra in (injected, {})
    )
    skip = first - round(record.grid.start / BIN)
    length = round(MEMORY / BIN)
    return {
        b: _seen(fit, b, r, pushed, plain)[skip : skip + length] / place.size
        for b, block in enumerate(model.chain.blocks) if block.drive == place.drive and block.order
    }  # fmt: skip


def _seen(fit: Fit, b: int, r: int, pushed: Outputs, plain: Outputs) -> Floats:
    record, block = fit.model.records[r], fit.model.chain.blocks[b]
    sensors = [record.sensors[o] for o in block.outputs]
    return np.column_stack([s.look(pushed) - s.look(plain) for s in sensors])


def injection_columns(
    place: Injection, course: Floats, ratio: float, radius: float
) -> dict[str, Floats]:
    """Columns of the inputs for a course of the injected quantity, row by row."""
    columns = {}
    for name, factor in place.push.items():
        factor /= ratio if place.over_ratio and name == "engine_disturbance" else 1.0
        factor *= radius if place.over_radius and name == "rear_brake" else 1.0
        columns[name] = factor * course
    assert set(columns) <= set(Inputs.names)
    return columns


def respond(answer: Floats, courses: Floats) -> Floats:
    """Answer to courses (T, k), one value a bin: (T, m, k)."""
    full = signal.fftconvolve(courses[:, None, :], answer[:, :, None], axes=0)
    return np.asarray(full[: len(courses)])
