"""Simulations of an FMU by slipbench and by fmpy, with the same inputs."""

from collections.abc import Iterator
from contextlib import redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import fmpy
import numpy as np

from benchmarks.other_fmus.fetch import OtherFmu
from slipbench.identification.mismatch.callables.call import Call, CallFailedError
from slipbench.identification.mismatch.callables.fmu.elements import Element
from slipbench.identification.mismatch.callables.fmu.plan import Plan
from slipbench.identification.mismatch.callables.fmu.runner import FmuRunner
from slipbench.identification.mismatch.callables.fmu.units import pint_name
from slipbench.identification.mismatch.callables.fmu.unpacked import (
    INTERFACES,
    UnpackedFmu,
    unpacked,
)
from slipbench.identification.mismatch.callables.fmu.variables import Port, port, suited
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError

STEPS = {"StateSpace3": 1.0, "Dahlquist": 0.1, "Feedthrough": 0.1, "Stair": 0.2}
"""Steps of communication, s; 10 ms of all others. The solvers of these take such steps."""
ROWS, LONG, FINE = 250, 40, 20
"""Rows of a simulation; where a step is 0.1 s or longer; steps of integration in a row."""
SWING, SWITCH = 0.2, 20
"""Amplitude of an input as a share of its start value; rows for which a switch stays."""
TOLERANCE = 1e-9
"""Relative, of fmpy's solver CVode in model exchange."""
FMPY = {"co_simulation": "CoSimulation", "model_exchange": "ModelExchange"}


@dataclass(frozen=True)
class Compared:
    """A comparison. difference: the largest of an output, in shares of its largest value.

    problem: what was said instead; empty: nothing.
    """

    interface: str
    step: float = 0.0
    rows: int = 0
    output: str = ""
    difference: float = 0.0
    problem: str = ""


def compared(one: OtherFmu) -> Iterator[Compared]:
    """Yield the comparison of each interface."""
    fmu = unpacked(one.path)
    for interface, own in INTERFACES.items():
        if getattr(fmu.description, own):
            try:
                yield _compared(one, fmu, interface)
            except (InputError, CallFailedError) as fault:
                yield Compared(interface, problem=str(fault).splitlines()[0])


def _compared(one: OtherFmu, fmu: UnpackedFmu, interface: str) -> Compared:
    step = next((s for name, s in STEPS.items() if one.name.startswith(name)), 0.01)
    step = min(step, 0.1) if interface == "model_exchange" else step
    rows = LONG if step >= 0.1 else ROWS
    rows = 20 if step >= 1.0 else rows
    inputs, outputs = (_ports(fmu, kind) for kind in ("input", "output"))
    held = tuple(p.discrete or interface == "co_simulation" for p in inputs)
    fine = step if interface == "co_simulation" else step / FINE
    plan = Plan(fmu, fmu.interface(interface), fine, (), inputs, outputs, held)
    times = np.asarray(step * np.arange(rows + 1), np.float64)
    still = interface == "model_exchange" and bool(fmu.description.derivatives)
    signals = {p.name: _signal(p, times, 0.0 if still else k + 1.0) for k, p in enumerate(inputs)}
    found = FmuRunner(plan)(Call({}, signals, times, tuple(p.name for p in outputs)))
    expected = _by_fmpy(one.path, interface, times, inputs, signals, outputs)
    calm = _calm(inputs, signals, rows)
    apart = {name: _apart(found[name][calm], expected[name][calm]) for name in found}
    worst = max(apart, key=lambda name: apart[name])
    return Compared(interface, step, rows, worst, apart[worst])


def _ports(fmu: UnpackedFmu, kind: str) -> tuple[Port, ...]:
    """Return all numbers of a causality, with their names in the FMU."""
    found = [e for e in suited(fmu.description, kind) if e.variable.causality == kind]
    found = [e for e in found if e.variable.alias is None]
    return tuple(port(fmu.description, e.name, e.name, _unit(e), kind, e.name) for e in found)


def _unit(element: Element) -> str:
    """Return the unit of the FMU, so that nothing is converted."""
    variable = element.variable
    return pint_name(variable.unit or getattr(variable.declaredType, "unit", None) or "1")


def _signal(own: Port, times: Floats, periods: float) -> Floats:
    """Return an input: a sine around its start value, or a switch between this and the next number.

    periods: of the sine in the whole time; 0: the input is constant, since fmpy sets it once in a step
    of its solver.
    """
    start, count = own.start, times.size
    if periods == 0.0:
        wave = np.ones(count)
    elif own.discrete:
        wave = (np.arange(count) // SWITCH + periods) % 2.0
    else:
        wave = np.sin(2.0 * np.pi * periods * times / times[-1])
    if own.kind.whole:
        return np.asarray(start + wave * (-1.0 if own.kind.name == "Boolean" and start else 1.0))
    return np.asarray(start + SWING * (abs(start) or 1.0) * wave)


def _calm(inputs: tuple[Port, ...], signals: dict[str, Floats], rows: int) -> Floats:
    """Return the samples at which no input jumps: before or after a jump is a convention."""
    calm = np.ones(rows + 1, bool)
    for own in inputs:
        if own.discrete:
            calm[1:] &= np.diff(signals[own.name]) == 0.0
    return calm


def _apart(found: Floats, expected: Floats) -> float:
    return float(np.max(np.abs(found - expected)) / max(np.max(np.abs(expected)), 1e-300))


def _by_fmpy(
    path: Path,
    interface: str,
    times: Floats,
    inputs: tuple[Port, ...],
    signals: dict[str, Floats],
    outputs: tuple[Port, ...],
) -> dict[str, Floats]:
    """Return the outputs as fmpy simulates them, by name."""
    rows, step = times.size, float(times[1])
    description = fmpy.read_model_description(str(path), validate=False)
    try:
        with redirect_stdout(StringIO()):  # warnings of inputs that keep their start
            table = fmpy.simulate_fmu(
                str(path),
                validate=False,
                start_time=0.0,
                stop_time=float(times[-1]),
                output_interval=step,
                step_size=step,
                solver="CVode",
                relative_tolerance=TOLERANCE,
                record_events=False,
                fmi_type=FMPY[interface],
                input=_table(description, times, inputs, signals),
                output=sorted({_variable(p) for p in outputs}),
            )
    except Exception as fault:  # fmpy raises plain exceptions
        raise CallFailedError(f"fmpy does not simulate it: {fault}") from fault
    if len(table) != rows:
        raise CallFailedError(f"fmpy gives {len(table)} rows, {rows} were asked for")
    return {p.name: _column(table, p) for p in outputs}


def _variable(own: Port) -> str:
    return own.name.partition("[")[0] if len(own.starts) > 1 else own.name


def _column(table: Any, own: Port) -> Floats:
    column = np.asarray(table[_variable(own)], np.float64)
    return column.reshape(len(column), -1)[:, own.index if column.ndim > 1 else 0]


def _table(
    description: Any, times: Floats, inputs: tuple[Port, ...], signals: dict[str, Floats]
) -> Any:
    """Return inputs as fmpy takes them."""
    if not inputs:
        return None
    shapes = {v.name: v.shape or () for v in description.modelVariables}
    kinds = {_variable(p): np.int64 if p.kind.whole else np.float64 for p in inputs}
    columns = [(name, kind, shapes[name]) for name, kind in kinds.items()]
    table = np.zeros(times.size, dtype=[("time", np.float64), *columns])
    table["time"] = times
    for own in inputs:
        column = table[_variable(own)]
        column.reshape(len(column), -1)[:, own.index if column.ndim > 1 else 0] = signals[own.name]
    return table
