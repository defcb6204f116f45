"""Times by which the equations of a model file delay a quantity: parameters, or constants."""

from collections.abc import Iterator

from slipbench.identification.mismatch.simulation.record import Record
from slipbench.identification.mismatch.systems.equations import Equations
from slipbench.identification.mismatch.systems.model_file import ModelFile
from slipbench.plant.signals import Floats
from slipbench.protocol.errors import InputError


def delay_times(e: Equations, values: Floats) -> tuple[float, ...]:
    """Time of each delay, s. values: of the parameters, SI."""
    times = (delay.time for _, delays in e.delays for delay in delays)
    return tuple(float(values[e.parameters.index(t)]) if isinstance(t, str) else t for t in times)


def without_negative(e: Equations, values: Floats) -> Floats:
    """Return the parameters with the times of delays at 0 or above."""
    kept = values.copy()
    for name in _names(e):
        k = e.parameters.index(name)
        kept[k] = max(kept[k], 0.0)
    return kept


def check_delays(e: Equations, file: ModelFile, where: str) -> None:
    """Raise InputError where a parameter that is the time of a delay is below 0."""
    for name in _names(e):
        told = file.parameters[name]
        if told.si < 0.0:
            raise InputError(
                f"the parameter {name!r} is the time of a delay, and below 0",
                where=f"{where}: parameters.{name}",
                expected="0 s or more: no equation knows the future",
                found=f"{told.value:g} {told.unit}",
                remedy="write the delay on the other quantities",
            )


def check_length(e: Equations, values: Floats, record: Record, where: str) -> None:
    """Raise InputError where a delay is as long as the recording."""
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
    """Yield the parameters that are times of delays."""
    for _, delays in e.delays:
        yield from (d.time for d in delays if isinstance(d.time, str))
