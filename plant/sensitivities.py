"""Forward sensitivities: outputs of a simulation and all their derivatives, in one run.

Tangents of every state go along with the states, through the same steps (tangents.py), so that
many derivatives cost as much as a few runs, and carry no step of differences.
"""

from collections.abc import Mapping, Sequence
from functools import cache
from itertools import pairwise
from types import ModuleType

import numpy as np

from slipbench.plant.composition import SERVO
from slipbench.plant.equations import EQUATIONS
from slipbench.plant.kernel import BAD_GEAR
from slipbench.plant.kernel_parts import LED
from slipbench.plant.kernel_rows import COLUMNS, UNUSED
from slipbench.plant.layout import EffectClass, layout
from slipbench.plant.signals import Floats, Inputs, Outputs
from slipbench.plant.simulation import Simulation
from slipbench.plant.tangent_reach import Reach, reach
from slipbench.plant.tangent_rows import Rows, Source
from slipbench.plant.tangents import compose_tangents

DELAYS = {"throttle_servo_delay": "throttle_command", "engine_spark_delay": "spark"}
"""Parameters that delay a command."""
GEAR = "gears."


def sensitivities(
    simulation: Simulation,
    state: Floats,
    inputs: Inputs,
    names: Sequence[str],
    columns: Mapping[str, int],
    state_slopes: Floats,
    input_slopes: Mapping[str, Floats],
) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Some outputs by name, shape (samples,), and their derivatives, shape (samples, columns).

    columns: of parameters by name, '<block>_<field>', '<effect>.<parameter>' or 'gears.<number>';
    state_slopes: derivatives of the initial states, shape (states, columns), the history being one
    of constant throttle as `Simulation.pack` makes it; input_slopes: derivatives of inputs by name,
    shape (rows, columns). A column may hold several of these. Raises ValueError as
    `Simulation.advance` does, and KeyError for a name that is no parameter.
    """
    total = state_slopes.shape[1]
    samples = len(inputs.table) * simulation.steps_per_row // simulation.every
    values = np.empty((len(names), samples))
    slopes = [np.empty((len(names), samples, 0))]
    edges = np.linspace(0, total, max(-(-total // COLUMNS), 1) + 1).astype(int)
    for first, last in pairwise(edges.tolist()):
        here = {name: c - first for name, c in columns.items() if first <= c < last}
        driven = {n: s[:, first:last] for n, s in input_slopes.items()}
        starts = np.ascontiguousarray(state_slopes[:, first:last])
        slopes.append(np.empty((len(names), samples, last - first)))
        _run(simulation, state, inputs, names, here, starts, driven, values, slopes[-1])
    whole = slopes[-1] if len(slopes) <= 2 else np.concatenate(slopes, axis=2)
    return dict(zip(names, values, strict=True)), dict(zip(names, whole, strict=True))


def _run(
    simulation: Simulation,
    state: Floats,
    inputs: Inputs,
    names: Sequence[str],
    columns: Mapping[str, int],
    starts: Floats,
    driven: Mapping[str, Floats],
    values: Floats,
    slopes: Floats,
) -> None:
    """Fill values and slopes; at most COLUMNS columns."""
    effects, servo = simulation.layout.effects, simulation.servo_only
    gears = [columns.get(f"{GEAR}{i + 1}", UNUSED) for i in range(len(simulation.ratios))]
    known = {*simulation.layout.parameters, *(f"{GEAR}{i + 1}" for i in range(len(gears)))}
    for name in columns:
        if name not in known:
            raise KeyError(f"'{name}' is no parameter of this simulation")
    reached = _reached(
        effects,
        servo,
        frozenset(effect.name for effect in simulation.motorcycle.effects),
        frozenset(columns),
        tuple(driven),
        tuple(bool(row.any()) for row in starts),
        tuple(s for s in LED if not np.isnan(inputs.table[:, _column(s)]).any()),
        tuple(names),
    )
    every = (*Outputs.names, *simulation.layout.effect_states)
    where = [columns.get(name, UNUSED) for name in simulation.layout.parameters]
    input_tangents = np.empty((len(driven), len(inputs.table), slopes.shape[2]))
    for target, given in zip(input_tangents, driven.values(), strict=True):
        target[:] = given
    done = _kernel(effects, servo).advance_tangents(
        state,
        inputs.table,
        simulation.parameters,
        simulation.ratios,
        simulation.step,
        simulation.steps_per_row,
        simulation.every,
        len(simulation.layout.states),
        simulation.delays,
        np.array([every.index(n) for n in names], np.int64),
        values.T,
        starts,
        np.array([Inputs.names.index(n) for n in driven], np.int64),
        input_tangents,
        np.array(where, np.int64),
        np.array(gears, np.int64),
        np.array([columns.get(n, UNUSED) for n in DELAYS], np.int64),
        reached.live,
        reached.wanted,
        reached.rows,
        slopes,
    )
    slopes[reached.rows < 0] = 0.0
    if done == BAD_GEAR:
        raise ValueError(f"gears {sorted(set(inputs.gear))} are not all gears of this motorcycle")


def _column(state: str) -> int:
    return Inputs.names.index(f"measured_{state}")


@cache
def _rows(effects: tuple[EffectClass, ...], servo: bool) -> Rows:
    return Rows(layout(effects), SERVO if servo else EQUATIONS)


def _kernel(effects: tuple[EffectClass, ...], servo: bool) -> ModuleType:
    return compose_tangents(effects, SERVO if servo else EQUATIONS)


@cache
def _reached(
    effects: tuple[EffectClass, ...],
    servo: bool,
    present: frozenset[str],
    columns: frozenset[str],
    driven: tuple[str, ...],
    starts: tuple[bool, ...],
    led: tuple[str, ...],
    shown: tuple[str, ...],
) -> Reach:
    rows = _rows(effects, servo)
    sources: list[Source] = [("state", i) for i, has in enumerate(starts) if has]
    for name in columns:
        source = ("gear", 0) if name.startswith(GEAR) else rows.source(name, None)
        assert source is not None
        sources.append(source)
        if name in DELAYS:
            sources.append(("command", DELAYS[name]))
    sources += [("input", Inputs.names.index(name)) for name in driven]
    sources += [("command", name) for name in driven if name in DELAYS.values()]
    return reach(rows, present, sources, led, shown)
