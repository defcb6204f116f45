"""Every effect at every place of a system where it may act."""

from collections.abc import Iterator
from functools import cache

from slipbench.identification.mismatch.systems.effects.library import BY_NAME, LIBRARY
from slipbench.identification.mismatch.systems.effects.seam_effect import (
    INPUT,
    OUTPUT,
    RATE,
    SEAM,
    Place,
    SeamEffect,
    placed,
)
from slipbench.identification.mismatch.systems.equations import rate_name
from slipbench.identification.mismatch.systems.model_file import (
    ActingEffect,
    DrivenInput,
    ModelFile,
    Number,
)
from slipbench.plant.errors import ParameterError, nearest
from slipbench.protocol.errors import InputError


def places(file: ModelFile) -> Iterator[Place]:
    """Yield the quantities at which something may act, in the kernel's order."""
    for name, told in file.inputs.items():
        yield _place(name, INPUT, told.size)
    for name, seam in file.seams.items():
        yield _place(name, SEAM, seam.size)
    for name, state in file.states.items():
        unit = f"{state.size.si_unit}/s" if state.size.si_unit != "1" else "1/s"
        yield Place(rate_name(name), RATE, unit, state.size.si / file.period)
    for name, output in file.outputs.items():
        yield _place(name, OUTPUT, output.size)


def _place(name: str, kind: str, size: Number) -> Place:
    return Place(name, kind, size.si_unit, abs(size.si))


@cache
def library(read: "Read") -> tuple[type[SeamEffect], ...]:
    """Return every effect at every place, and at every variant of what varies."""
    return tuple(
        placed(kind, used, read.file.period, factor)
        for kind in LIBRARY
        for place in places(read.file)
        if _suits(kind, place, read.file)
        for used in _using(kind, place, read.file)
        for factor in kind.variants
    )


class Read:
    """A model file as a key of a cache: itself alone is equal to it."""

    def __init__(self, file: ModelFile) -> None:
        self.file = file


def _using(kind: type[SeamEffect], place: Place, file: ModelFile) -> Iterator[Place]:
    """Yield the place once for every other quantity that the effect may use there."""
    if not kind.uses:
        yield place
    elif kind.uses == "along":
        along = _speed_at(place, file)
        if along:
            yield _with(place, along, file)
    elif kind.uses == "into":
        state = next(s for s in file.states if rate_name(s) == place.name)
        yield _with(place, state, file)
    else:
        for name, told in file.inputs.items():
            angle = told.size.si_unit == "rad"
            if name != place.name and (kind.uses == "channel" or angle):
                yield _with(place, name, file)


def _suits(kind: type[SeamEffect], place: Place, file: ModelFile) -> bool:
    """Tell whether an effect may act at a place; what acts along a speed needs one."""
    return place.kind in kind.acts_on or (kind.uses == "along" and bool(_speed_at(place, file)))


def _speed_at(place: Place, file: ModelFile) -> str:
    """Return the quantity that is the speed at a seam or an input; empty: none is known."""
    if place.kind == SEAM:
        return file.seams[place.name].along
    told = file.inputs.get(place.name)
    return told.along if isinstance(told, DrivenInput) else ""


def _with(place: Place, other: str, file: ModelFile) -> Place:
    sizes = {n: told.size for part in (file.outputs, file.inputs) for n, told in part.items()}
    size = file.states[other].size if other in file.states else sizes[other]
    return Place(place.name, place.kind, place.unit, place.size, other, size.si_unit, abs(size.si))


def acting(entry: ActingEffect, file: ModelFile, where: str) -> SeamEffect:
    """Return an effect that the file says acts. Raises InputError."""
    if entry.name not in BY_NAME:
        raise InputError(
            f"no effect {entry.name!r}", where=where, remedy=nearest(entry.name, BY_NAME)
        )
    kind = BY_NAME[entry.name]
    found = [
        used
        for place in places(file)
        if _suits(kind, place, file) and place.name == entry.at
        for used in _using(kind, place, file)
        if not entry.using or used.other == entry.using
    ]
    if len(found) != 1:
        allowed = sorted({p.name for p in places(file) if _suits(kind, p, file)})
        raise InputError(
            f"{entry.name} cannot act at {entry.at!r} using {entry.using!r}",
            where=where,
            expected=f"one of {', '.join(allowed) or 'no place of this system'}",
        )
    try:
        values = {name: number.si for name, number in entry.values.items()}
        return placed(kind, found[0], file.period)(**values)
    except (TypeError, ParameterError) as fault:
        raise InputError(str(fault), where=where) from fault
