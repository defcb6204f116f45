"""Delay times in the equations of a model file: parameters or constants."""

from collections.abc import Iterator

from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.systems.equations import Equations
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError


def delay_times(e: Equations, values: Floats) -> tuple[float, ...]:
    """Return the time of each delay, s. values: of the parameters, SI, (parameters,)."""
    times = (delay.time for _, delays in e.delays for delay in delays)
    return tuple(float(values[e.parameters.index(t)]) if isinstance(t, str) else t for t in times)


def without_negative(e: Equations, values: Floats) -> Floats:
    """Return the parameters, SI, (parameters,), with delay times limited to 0 s or more."""
    limited = values.copy()
    for name in _names(e):
        k = e.parameters.index(name)
        limited[k] = max(limited[k], 0.0)
    return limited


def check_delays(e: Equations, file: ModelFile, where: str) -> None:
    """Raise InputError where a parameter that is a delay time is below 0."""
    for name in _names(e):
        number = file.parameters[name]
        if number.si < 0.0:
            raise InputError(
                f"the parameter {name!r} is the time of a delay, and below 0",
                where=f"{where}: parameters.{name}",
                expected="0 s or more: no equation knows the future",
                found=f"{number.value:g} {number.unit}",
                remedy="write the delay on the other quantities",
            )


def check_length(e: Equations, values: Floats, record: Record, where: str) -> None:
    """Raise InputError where a delay is as long as the recording. values: SI, (parameters,)."""
    length = record.grid.rows * record.grid.step
    longest = max(delay_times(e, values), default=0.0)
    if longest >= length:
        raise InputError(
            "a delay is as long as the recording, or longer",
            where=f"{where} on {record.name}",
            expected=f"less than {length:.3g} s",
            found=f"{longest:.3g} s",
            remedy="check the unit of the delay's time, or give a longer recording",
        )


def _names(e: Equations) -> Iterator[str]:
    """Yield the names of the parameters that are delay times."""
    for _, delays in e.delays:
        yield from (d.time for d in delays if isinstance(d.time, str))
