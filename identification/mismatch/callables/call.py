"""Interface of an external simulation: arguments and results of one run.

The simulation is a function of parameters, inputs and times. Times are evenly spaced from 0.
Between two times an input is held or linearly interpolated, as its description specifies.
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
"""simulate(parameters, inputs, times) -> outputs by name, arrays of the same length as times."""
REPEATABILITY_TOLERANCE = 1e-9
"""Tolerance between two runs with the same parameters, relative to the largest value."""


class CallFailedError(Exception):
    """An external simulation could not be run at one set of parameters; the text states the reason.

    lost: whether further runs are not attempted.
    """

    lost = False


class SimulationLostError(CallFailedError):
    """The simulation hung or crashed too often and is not run again."""

    lost = True


@dataclass(frozen=True, eq=False)
class Call:
    """Arguments of one run.

    parameters: in the units of their description. inputs: (n,) by name. times: (n,), s. outputs:
    names of the outputs to return. rates: disturbances and effects on state derivatives, or None.
    """

    parameters: Mapping[str, float]
    inputs: Mapping[str, Floats]
    times: Floats
    outputs: tuple[str, ...]
    rates: ActingRates | None = None


Caller = Callable[[Call], dict[str, Floats]]
"""Runs a call and returns its outputs, (n,), finite. Raises CallFailedError."""


def in_process(simulate: Simulate) -> Caller:
    """Run a function in this process; each output has the shape of the times, (n,).

    An exception or an invalid result raises CallFailedError.
    """

    def call(request: Call) -> dict[str, Floats]:
        inputs = {name: np.array(values) for name, values in request.inputs.items()}
        try:
            returned = simulate(dict(request.parameters), inputs, np.array(request.times))
        except CallFailedError:
            raise
        except Exception as fault:
            if is_interrupt(fault):
                raise
            raise CallFailedError(f"it raised {type(fault).__name__}: {fault}") from fault
        return checked(returned, request.outputs, request.times.size)

    return call


def checked(returned: object, outputs: Sequence[str], count: int) -> dict[str, Floats]:
    """Return the outputs as arrays, shape (count,) each.

    Raises CallFailedError where `returned` is no mapping, or where one of them is missing, not
    real, not finite or of another shape.
    """
    if not isinstance(returned, Mapping):
        raise CallFailedError(
            f"it returned {type(returned).__name__}, not a mapping from output name to array"
        )
    missing = [name for name in outputs if name not in returned]
    if missing:
        available = ", ".join(map(str, returned)) or "nothing"
        raise CallFailedError(f"it did not return {', '.join(missing)}; it returned {available}")
    return {name: _array(name, returned[name], count) for name in outputs}


def _array(name: str, value: Any, count: int) -> Floats:
    if np.iscomplexobj(value):
        raise CallFailedError(f"{name} is no array of real numbers: it is complex")
    try:
        array = np.array(value, np.float64)
    except (TypeError, ValueError) as fault:
        raise CallFailedError(f"{name} is no array of real numbers: {fault}") from fault
    if array.shape != (count,):
        raise CallFailedError(f"{name} has shape {array.shape}; expected {(count,)}, that of times")
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise CallFailedError(
            f"{name} is {array[bad[0]]} at sample {bad[0]} of {count}, and not finite in {bad.size}"
        )
    return array


def difference(one: Mapping[str, Floats], other: Mapping[str, Floats]) -> str:
    """Describe where two runs with the same parameters differ; empty where they agree.

    one, other: outputs by name, (n,) each.
    """
    for name, values in one.items():
        largest = float(np.max(np.abs(values - other[name]), initial=0.0))
        if largest > REPEATABILITY_TOLERANCE * float(np.max(np.abs(values), initial=0.0)):
            return f"{name} differs by up to {largest:.3g}"
    return ""
