"""A Python function as a system for the mismatch analysis."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from slipbench.identification.mismatch.callables.call import Simulate, in_process
from slipbench.identification.mismatch.callables.description import (
    Ports,
    bounds,
    described,
    name_of,
    text_of,
)
from slipbench.identification.mismatch.callables.parameter import Parameter
from slipbench.identification.mismatch.callables.simulator import ExternalSimulator
from slipbench.identification.mismatch.callables.worker import CAN_ISOLATE, IsolatedCaller
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.recording import Recording


def function_system(
    simulate: Simulate,
    parameters: Mapping[str, Parameter],
    ports: Ports,
    training: Sequence[Recording],
    time_limit: float | None = None,
) -> ModelSystem:
    """Return the system of a function. Raises InputError where its description is invalid.

    time_limit: of one run, s, in a separate process where the platform supports it; None: in this
    process, without limit.
    """
    name = name_of(simulate)
    file = described(name, parameters, ports, training)
    caller = in_process(simulate)
    if time_limit is not None and CAN_ISOLATE:
        caller = IsolatedCaller(caller, time_limit)
    simulator = ExternalSimulator(caller, *bounds(parameters, file), "the function")
    return replace(ModelSystem.of(file, name, simulator), source=text_of(file))
