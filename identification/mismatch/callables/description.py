"""Description of a Python function as a model file without equations.

Magnitudes and periods of the model file are taken from the training recordings.
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
"""Placeholder for the equation of an output, whose value an external simulation returns."""


@dataclass(frozen=True)
class Ports:
    """Roles of the recorded signals that are inputs and outputs of a simulation.

    linear: inputs that are linearly interpolated between samples; all others are held. speeds:
    input -> output that is the speed of the driven part, the regressor of friction. period: of the
    bins in which residuals are tested, s; 0: sampling period of the slowest output.
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    linear: tuple[str, ...] = ()
    period: float = 0.0
    speeds: Mapping[str, str] = field(default_factory=dict)


def described(
    name: str, parameters: Mapping[str, Parameter], ports: Ports, recordings: Sequence[Recording]
) -> ModelFile:
    """Return the description of a function. Raises InputError for invalid parameters or ports."""
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
    """Return lower and upper bounds of the parameters, SI, (parameters,) each."""
    ends = ([], [])  # type: tuple[list[float], list[float]]
    for key, one in parameters.items():
        for found, end in zip(ends, one.bounds or (-math.inf, math.inf), strict=True):
            unit = file.parameters[key].unit
            found.append(end if math.isinf(end) else Number(value=end, unit=unit).si)
    return np.array(ends[0]), np.array(ends[1])


def text_of(file: ModelFile) -> str:
    """Return a description as TOML, the template of the improved file."""
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
    recorded = sorted({role for r in recordings for role in r.channels})
    if not ports.outputs:
        raise InputError(
            "the outputs are not named",
            where=name,
            expected="outputs=[...], roles of the recordings",
            found=f"recorded: {', '.join(recorded)}",
        )
    for role in (*ports.inputs, *ports.outputs):
        if role not in recorded:
            raise InputError(
                f"{role!r} was not recorded", where=name, remedy=nearest(role, recorded)
            )
    for option, roles, known in (
        ("linear", ports.linear, ports.inputs),
        ("speeds", tuple(ports.speeds), ports.inputs),
        ("speeds", tuple(ports.speeds.values()), ports.outputs),
    ):
        _check_known(option, roles, known, name)
    duplicates = sorted({*ports.inputs} & {*ports.outputs})
    if duplicates:
        raise InputError(f"{duplicates[0]!r} is an input and an output", where=name)


def _check_known(option: str, roles: Sequence[str], known: Sequence[str], name: str) -> None:
    for role in roles:
        if role not in known:
            raise InputError(f"{option} names {role!r}", where=name, remedy=nearest(role, known))


def _size(role: str, recordings: Sequence[Recording]) -> Number:
    """Return the root mean square of a role over all recordings that contain it."""
    channels = list(_channels(role, recordings))
    values = np.concatenate([c.value[np.isfinite(c.value)] for c in channels])
    size = float(np.sqrt(np.mean(values**2))) if values.size else 0.0
    return Number(value=float(f"{size:.3g}") or 1.0, unit=channels[0].unit)


def _period(role: str, recordings: Sequence[Recording]) -> float:
    """Return the sampling period of a role, s: the largest median interval of its recordings."""
    intervals: list[float] = [
        float(np.median(np.diff(c.time))) for c in _channels(role, recordings) if c.time.size > 1
    ]
    if not intervals or not max(intervals) > 0.0:
        raise InputError(f"{role!r} has no two samples at different times")
    return float(f"{max(intervals):.9g}")


def _channels(role: str, recordings: Sequence[Recording]) -> Iterable[Channel]:
    return (r.channels[role] for r in recordings if role in r.channels)


def name_of(simulate: Callable[..., object]) -> str:
    """Return the name of a function, or of the class of a callable object."""
    return str(getattr(simulate, "__name__", type(simulate).__name__))
