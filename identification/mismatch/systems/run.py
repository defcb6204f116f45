"""One recording simulated by the system of a model file."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.systems.board import PARAMETERS_OF_ONE, board
from slipbench.identification.mismatch.systems.delay_times import delay_times
from slipbench.identification.mismatch.systems.effects.library import CODES
from slipbench.identification.mismatch.systems.effects.seam_effect import OUTPUT, SeamEffect
from slipbench.identification.mismatch.systems.equations import Equations, rate_name
from slipbench.identification.mismatch.systems.kernel import (
    CURVE,
    FINE,
    PERIODIC_CURVE,
    compose,
    first_input,
)
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.identification.mismatch.systems.placing import unseen_angle
from slipbench.identification.mismatch.systems.stops import check_order
from slipbench.identification.mismatch.systems.table_curve import RATE, TableCurve, known_quantities
from slipbench.plant.effects.effect import Effect
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

BOUND = 1e6
"""Largest value of a state, in its usual magnitude; beyond it a simulation has diverged."""
MOST_RING = 1 << 20  # steps
Integers = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class SimulatedColumns:
    """Columns of a run: quantities of places after effects, states; outputs with delays."""

    columns: Mapping[str, Floats]

    def __getitem__(self, name: str, /) -> Floats:
        """Return a column, (rows,)."""
        return self.columns[name]


def run(
    e: Equations,
    file: ModelFile,
    values: Floats,
    effects: Iterable[Effect],
    record: Record,
    push: Floats,
) -> SimulatedColumns:
    """Simulate all rows. push: input disturbances, (rows, places). values: SI, (parameters,).

    Raises PlantError where numbers grow without bound, and where stops are in the wrong order.
    """
    check_order(e.stops, e.parameters, values)
    grid = record.grid
    substeps = max(1, int(np.ceil(grid.step / file.step - 1e-9)))
    step = grid.step / substeps
    effects = tuple(effects)
    acting = [x for x in effects if isinstance(x, SeamEffect)]
    compiled = [x for x in acting if x.act is not None]
    curves = [x for x in effects if isinstance(x, TableCurve)]
    slot_arrays = slots(compiled, curves, e, file)
    effect_delays = (float(getattr(x, x.delay_parameter)) for x in compiled if x.delay_parameter)
    ring = ring_length((*effect_delays, *delay_times(e, values)), step)
    held = np.array([1.0 if entry.steps else 0.0 for entry in file.inputs.values()])
    out = np.full((grid.rows, len(e.places) + len(e.states)), np.nan)
    status = compose(e).advance(
        _initial_states(file, record),
        np.ascontiguousarray(record.inputs, np.float64),
        _slopes(curves, record),
        held,
        np.ascontiguousarray(push),
        values,
        board(*slot_arrays, len(e.states), first_input(e) + len(e.inputs)),
        _tables(curves, len(slot_arrays[0])),
        ring,
        step,
        substeps,
        out,
    )
    sizes = np.array([state.size.si for state in file.states.values()])
    diverged = np.abs(out[:, len(e.places) :]) > BOUND * np.abs(sizes)
    if status != FINE or not np.isfinite(out).all() or diverged.any():
        raise PlantError(
            "the simulation grows without bound",
            f"{file.name} on {record.name}",
            "finite numbers",
            ", ".join(x.key for x in (*curves, *acting)) or "no effect",
            "correct the equations, or take a smaller step",
        )
    columns = dict(zip((*e.places, *e.states), out.T, strict=True))
    for effect in acting:
        if effect.place.kind == OUTPUT and (delay := effect.late(record.time)) is not None:
            name = effect.place.name
            columns[name] = np.interp(record.time - delay, record.time, columns[name])
    return SimulatedColumns(columns)


def slots(
    effects: list[SeamEffect], curves: list[TableCurve], e: Equations, file: ModelFile
) -> tuple[Integers, Integers, Integers, Floats]:
    """Return code, place, other quantity and parameters of every curve, then of every effect.

    Effects are in the library's order. Shapes (all,), and (all, PARAMETERS_OF_ONE) of the
    parameters, SI.
    """
    total = len(curves) + len(effects)
    code, where, other = (np.zeros(total, np.int64) for _ in range(3))
    par = np.zeros((total, PARAMETERS_OF_ONE))
    for i, curve in enumerate(curves):
        code[i] = PERIODIC_CURVE if curve.repeats else CURVE
        where[i] = e.places.index(curve.place)
        other[i] = known_quantities(curve.place, e, file)[curve.along]
    ordered = sorted(effects, key=lambda x: CODES[x.name])
    for i, effect in enumerate(ordered, start=len(curves)):
        code[i] = CODES[effect.name]
        where[i] = e.places.index(effect.place.name)
        other[i] = _other(effect, e, file)
        numbers = list(effect.values())
        par[i, : len(numbers)] = numbers
    return code, where, other, par


def _other(effect: SeamEffect, e: Equations, file: ModelFile) -> int:
    """Return the index of the quantity that an effect uses or adds to; -1: none."""
    name = effect.place.other
    if effect.gives:
        state = next(s for s in e.states if rate_name(s) == effect.place.name)
        name = file.states[state].overflows_into
    return first_input(e) + (*e.inputs, *e.states).index(name) if name else -1


def _tables(curves: list[TableCurve], slots: int) -> Floats:
    """Return knots and values of all curves, (slots, 2, knots); short ones repeat their last."""
    stacked = [np.stack(c.table) for c in curves]
    longest = max((one.shape[1] for one in stacked), default=1)
    tables = np.zeros((slots, 2, longest))
    for i, one in enumerate(stacked):
        tables[i] = np.pad(one, ((0, 0), (0, longest - one.shape[1])), "edge")
    return tables


def _slopes(curves: list[TableCurve], record: Record) -> Floats:
    """Return the rate of every input, (rows, inputs), as regressors of curves; 0 where unused."""
    slopes = np.zeros(record.inputs.shape)
    if any(c.along.endswith(RATE) for c in curves):
        for k, series in enumerate(record.inputs.T):
            slopes[:, k] = record.grid.rate(series)
    return slopes


def ring_length(delays: Iterable[float], step: float) -> int:
    """Return the past steps that delays need, a power of two. Raises PlantError for too many.

    delays, step: s.
    """
    longest = max(delays, default=0.0)
    steps = int(longest / step) + 4
    if steps > MOST_RING:
        raise PlantError(
            "a delay is too long", "delay", f"{MOST_RING} steps", f"{steps}", "take a larger step"
        )
    return 1 << (steps - 1).bit_length()


def _initial_states(file: ModelFile, record: Record) -> Floats:
    """Return the initial states: as stated, from an output, or with the estimated angle."""
    initial, unmeasured = [], unseen_angle(file)
    for name, state in file.states.items():
        if isinstance(state.start, str):
            initial.append(float(record.measured[state.start][0]))
        else:
            initial.append(state.start.si + (record.turned if name == unmeasured else 0.0))
    return np.array(initial, np.float64)
