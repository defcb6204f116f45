"""The description of a Python function as a model file without equations.

Magnitudes and periods that a model file states are taken from the training recordings.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import tomli_w
from pydantic import ValidationError

from slipbench.identification.mismatch.callables.parameter import Parameter
from slipbench.identification.mismatch.systems.model_file import (
    DrivenInput,
    ModelFile,
    Number,
    Output,
)
from slipbench.plant.errors import nearest
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording

NOT_AN_EQUATION = "0"
"""Stands where a model file has the equation of an output: a function gives its value."""


@dataclass(frozen=True)
class Ports:
    """Roles of the recordings that a simulation takes and gives.

    linear: inputs that follow straight lines between samples; all others hold until the next one.
    speeds: input -> output that is the speed of what it drives: friction may act along it. period:
    of the bins in which residuals are tested, s; 0: that of the slowest output.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    linear: tuple[str, ...] = ()
    period: float = 0.0
    speeds: Mapping[str, str] = field(default_factory=dict)


def described(
    name: str, parameters: Mapping[str, Parameter], ports: Ports, recordings: Sequence[Recording]
) -> ModelFile:
    """Describe a function. Raises InputError where parameters or ports cannot be used."""
    _check_ports(ports, recordings, name)
    numbers = {key: one.number(f"{name}, parameter {key!r}") for key, one in parameters.items()}
    sizes = {role: _size(role, recordings) for role in (*ports.inputs, *ports.outputs)}
    period = ports.period or max(_period(role, recordings) for role in ports.outputs)
    try:
        return ModelFile(
            name=name,
            step=period,
            period=period,
            parameters=numbers,
            inputs={
                role: DrivenInput(
                    role=role,
                    size=sizes[role],
                    held=role not in ports.linear,
                    along=ports.speeds.get(role, ""),
                )
                for role in ports.inputs
            },
            outputs={
                role: Output(role=role, value=NOT_AN_EQUATION, size=sizes[role])
                for role in ports.outputs
            },
        )
    except ValidationError as fault:
        reasons = "; ".join(str(error["msg"]) for error in fault.errors())
        raise InputError("the description cannot be used", where=name, found=reasons) from fault


def bounds(parameters: Mapping[str, Parameter], file: ModelFile) -> tuple[Floats, Floats]:
    """Least and greatest values, SI, (parameters,) each."""
    ends = ([], [])  # type: tuple[list[float], list[float]]
    for key, one in parameters.items():
        for found, end in zip(ends, one.bounds or (-math.inf, math.inf), strict=True):
            unit = file.parameters[key].unit
            found.append(end if math.isinf(end) else Number(value=end, unit=unit).si)
    return np.array(ends[0]), np.array(ends[1])


def text_of(file: ModelFile) -> str:
    """Return a description as TOML: what an improved one is written into."""
    tree = {
        "name": file.name,
        "parameters": {k: n.model_dump(exclude_none=True) for k, n in file.parameters.items()},
        "inputs": {k: _port(i.role, i.size) | {"held": i.held} for k, i in file.inputs.items()},
        "outputs": {k: _port(o.role, o.size) for k, o in file.outputs.items()},
    }
    return tomli_w.dumps(tree)


def _port(role: str, size: Number) -> dict[str, object]:
    return {"role": role, "size": size.model_dump(exclude_none=True)}


def _check_ports(ports: Ports, recordings: Sequence[Recording], name: str) -> None:
    there = sorted({role for r in recordings for role in r.channels})
    if not ports.outputs:
        raise InputError(
            "the outputs are not named",
            where=name,
            expected="outputs=[...], roles of the recordings",
            found=f"recorded: {', '.join(there)}",
        )
    for role in (*ports.inputs, *ports.outputs):
        if role not in there:
            raise InputError(f"{role!r} was not recorded", where=name, remedy=nearest(role, there))
    for what, roles, known in (
        ("linear", ports.linear, ports.inputs),
        ("speeds", tuple(ports.speeds), ports.inputs),
        ("speeds", tuple(ports.speeds.values()), ports.outputs),
    ):
        _check_known(what, roles, known, name)
    both = sorted({*ports.inputs} & {*ports.outputs})
    if both:
        raise InputError(f"{both[0]!r} is an input and an output", where=name)


def _check_known(what: str, roles: Sequence[str], known: Sequence[str], name: str) -> None:
    for role in roles:
        if role not in known:
            raise InputError(f"{what} names {role!r}", where=name, remedy=nearest(role, known))


def _size(role: str, recordings: Sequence[Recording]) -> Number:
    """Root mean square of a role over all recordings that have it."""
    channels = list(_channels(role, recordings))
    values = np.concatenate([c.value[np.isfinite(c.value)] for c in channels])
    size = float(np.sqrt(np.mean(values**2))) if values.size else 0.0
    return Number(value=float(f"{size:.3g}") or 1.0, unit=channels[0].unit)


def _period(role: str, recordings: Sequence[Recording]) -> float:
    """Time between two samples of a role, as a rule, s."""
    apart: list[float] = [
        float(np.median(np.diff(c.time))) for c in _channels(role, recordings) if c.time.size > 1
    ]
    if not apart or not max(apart) > 0.0:
        raise InputError(f"{role!r} has no two samples at different times")
    return float(f"{max(apart):.9g}")


def _channels(role: str, recordings: Sequence[Recording]) -> Iterable[Channel]:
    return (r.channels[role] for r in recordings if role in r.channels)


def name_of(simulate: Callable[..., object]) -> str:
    """Name of a function or of the class of an object that can be called."""
    return str(getattr(simulate, "__name__", type(simulate).__name__))
