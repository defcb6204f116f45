"""What a simulation from outside is asked, and what it has to return.

A function of parameters, inputs and times. Times are evenly spaced and start at 0. An input's value
at a time holds until the next one, or lies on the straight line to it, as its description says.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.identification.mismatch.callables.acting_rates import ActingRates
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import is_interrupt

Simulate = Callable[
    [Mapping[str, float], Mapping[str, Floats], Floats], Mapping[str, npt.ArrayLike]
]
"""simulate(parameters, inputs, times) -> outputs, arrays of the times' length, by name."""
ALIKE = 1e-9
"""Share of the largest value by which two runs with the same parameters may differ."""


class CallFailedError(Exception):
    """A simulation from outside could not be run at one set of parameters; the text says why.

    lost: whether another run cannot be hoped for.
    """

    lost = False


class SimulationLostError(CallFailedError):
    """The simulation has failed so often in a way that costs time that it is not run again."""

    lost = True


@dataclass(frozen=True, eq=False)
class Call:
    """One run. parameters: in the units of their description. inputs: (n,) by name. times: (n,), s.

    outputs: names of what has to be returned. rates: what acts on rates of states; None: nothing.
    """

    parameters: Mapping[str, float]
    inputs: Mapping[str, Floats]
    times: Floats
    outputs: tuple[str, ...]
    rates: ActingRates | None = None


Caller = Callable[[Call], dict[str, Floats]]
"""Runs a call; returns its outputs, (n,) and finite. Raises CallFailedError."""


def in_process(simulate: Simulate) -> Caller:
    """Run a function in this process; an exception, or another result than asked, is a failure."""

    def call(asked: Call) -> dict[str, Floats]:
        inputs = {name: np.array(values) for name, values in asked.inputs.items()}
        try:
            told = simulate(dict(asked.parameters), inputs, np.array(asked.times))
        except CallFailedError:
            raise
        except Exception as fault:
            if is_interrupt(fault):
                raise
            raise CallFailedError(f"it raised {type(fault).__name__}: {fault}") from fault
        return checked(told, asked.outputs, asked.times.size)

    return call


def checked(told: object, outputs: Sequence[str], count: int) -> dict[str, Floats]:
    """Return the outputs as arrays (count,). Raises CallFailedError where one is not of use."""
    if not isinstance(told, Mapping):
        raise CallFailedError(
            f"it returned {type(told).__name__}, not a mapping from output name to array"
        )
    absent = [name for name in outputs if name not in told]
    if absent:
        there = ", ".join(map(str, told)) or "nothing"
        raise CallFailedError(f"it did not return {', '.join(absent)}; it returned {there}")
    return {name: _array(name, told[name], count) for name in outputs}


def _array(name: str, value: Any, count: int) -> Floats:
    if np.iscomplexobj(value):
        raise CallFailedError(f"{name} is no array of real numbers: it is complex")
    try:
        found = np.array(value, np.float64)
    except (TypeError, ValueError) as fault:
        raise CallFailedError(f"{name} is no array of real numbers: {fault}") from fault
    if found.shape != (count,):
        raise CallFailedError(f"{name} has shape {found.shape}; expected {(count,)}, that of times")
    bad = np.flatnonzero(~np.isfinite(found))
    if bad.size:
        raise CallFailedError(
            f"{name} is {found[bad[0]]} at sample {bad[0]} of {count}, and not finite in {bad.size}"
        )
    return found


def difference(one: Mapping[str, Floats], other: Mapping[str, Floats]) -> str:
    """Say where two runs with the same parameters differ; empty where they do not."""
    for name, values in one.items():
        most = float(np.max(np.abs(values - other[name]), initial=0.0))
        if most > ALIKE * float(np.max(np.abs(values), initial=0.0)):
            return f"{name} differs by up to {most:.3g}"
    return ""
