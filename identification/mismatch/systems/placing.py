"""Every effect of the library at every injection point of a system where it may act."""

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from functools import cache

import numpy as np

from slipbench.identification.mismatch.simulation.turn import Turn
from slipbench.identification.mismatch.systems.effects.cogging import Cogging
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
from slipbench.identification.mismatch.systems.effects.unbalance import Unbalance
from slipbench.identification.mismatch.systems.equations import rate_name
from slipbench.identification.mismatch.systems.magnitude import usual_rates
from slipbench.identification.mismatch.systems.model_file import (
    ActingEffect,
    DrivenInput,
    DrivenState,
    Input,
    ModelFile,
    Number,
    Output,
    State,
)
from slipbench.plant.errors import ParameterError, nearest
from slipbench.protocol.errors import InputError

LINE = 0.02
"""Amplitude of an order line whose response is simulated, in the usual magnitude of its place."""
POSITIONS = ("rad", "m", "count")
"""Units of the command of a position loop."""


def places(file: ModelFile) -> Iterator[Place]:
    """Yield the injection points: quantities at which an effect may act, in kernel order."""
    for name, entry in file.inputs.items():
        if not (isinstance(entry, DrivenInput) and entry.exact):
            yield _place(name, INPUT, entry.size)
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
    """Return every effect at every place, once for each of its variants."""
    return tuple(
        placed(kind, used, read.file.period, factor)
        for kind in LIBRARY
        for place in places(read.file)
        if _suits(kind, place, read.file)
        for used in _using(kind, place, read.file)
        for factor in kind.variants
    )


class Read:
    """A model file as a key of a cache; it is compared by identity."""

    def __init__(self, file: ModelFile) -> None:
        self.file = file


def _using(kind: type[SeamEffect], place: Place, file: ModelFile) -> Iterator[Place]:
    """Yield the place once for each other quantity that the effect may use there."""
    if not kind.uses:
        yield place
    elif kind.uses == "along":
        speed = _speed_at(place, file)
        if speed:
            yield _with(_with_usual_rate(place, file), speed, file)
    elif kind.uses in ALONE:
        if ALONE[kind.uses](place, file):
            yield place
    else:
        for name in _others(kind.uses, place, file):
            yield _with(place, name, file)


def _with_usual_rate(place: Place, file: ModelFile) -> Place:
    """Return a place; at the rate of a state, with the usual magnitude of the rate as its size.

    An effect over a speed is a force comparable to the usual ones. A limit has the largest rate as
    its size instead: the state changes by its size within a period.
    """
    if place.kind != RATE:
        return place
    return replace(place, size=usual_rates(file)[_state(place, file)])


def _others(uses: str, place: Place, file: ModelFile) -> Iterable[str]:
    """Return the inputs and states that an effect may use at a place."""
    inputs = [name for name in file.inputs if name != place.name]
    if uses == "into":
        return (_state(place, file),)
    if uses == "position":
        return _positions(_state(place, file), file)
    if uses == "speed":
        return (name for name in file.states if is_speed(name, file))
    if uses == "channel":
        return inputs
    if uses == "turn":
        return (name for name in turning(file) if name != place.name)
    return (name for name in inputs if _entry(name, file).size.si_unit == "rad")


def turning(file: ModelFile) -> list[str]:
    """Return the names of inputs and states that are rotation angles."""
    return [name for name in (*file.inputs, *file.states) if _rotates(name, file)]


def _rotates(name: str, file: ModelFile) -> bool:
    """Return whether a quantity is a rotation angle; an input of less than a turn is not."""
    size = _entry(name, file).size
    return size.si_unit == "rad" and (name in file.states or abs(size.si) >= 2.0 * math.pi)


def lines(file: ModelFile) -> Iterator[Turn]:
    """Yield order lines of forces, which can identify the initial value of an unmeasured angle."""
    angle = unseen_angle(file)
    for place in places(file) if angle else ():
        if place.kind == SEAM:
            at = _with(place, angle, file)
            size = LINE * place.size
            first_order: Callable[..., SeamEffect] = placed(Unbalance, at, file.period)
            higher_order: Callable[..., SeamEffect] = placed(Cogging, at, file.period)
            yield Turn(first_order(size, 0.0), first_order(size, 0.5 * math.pi), 1.0)
            order = next(p for p in Cogging.parameters() if p.name == "order")
            for n in np.arange(order.low, order.high + 1.0):
                yield Turn(
                    higher_order(size, n, 0.0), higher_order(size, n, 0.5 * math.pi), float(n)
                )


def unseen_angle(file: ModelFile) -> str:
    """Return the rotation angle of unknown initial value: only its speed is recorded.

    It is a state, its initial value is stated in the file and is not exact, and no equation uses
    it. Empty: there is none, or there are several.
    """
    texts = [s.value for s in file.seams.values()] + [o.value for o in file.outputs.values()]
    texts += [s.rate for s in file.states.values()]
    names = [
        name
        for name in turning(file)
        if (state := file.states.get(name)) is not None
        and not isinstance(state, DrivenState)
        and not isinstance(state.start, str)
        and not (state.first is not None and state.first.si == 0.0)
        and not any(re.search(rf"\b{name}\b", text) for text in texts)
    ]
    return names[0] if len(names) == 1 else ""


def _state(place: Place, file: ModelFile) -> str:
    """Return the state at whose rate a place is."""
    return next(s for s in file.states if rate_name(s) == place.name)


def _positions(speed: str, file: ModelFile) -> list[str]:
    """Return the states whose rate is just this state."""
    return [name for name, state in file.states.items() if state.rate.strip() == speed]


def is_speed(state: str, file: ModelFile) -> bool:
    """Return whether a state is a speed: of a position, of a seam (`along`), or by its unit."""
    of_seam = any(seam.along == state for seam in file.seams.values())
    unit = file.states[state].size.si_unit
    return of_seam or bool(_positions(state, file)) or unit.endswith("/s")


def is_store(state: str, file: ModelFile) -> bool:
    """Return whether a state is neither a speed nor the integral of another state."""
    return not is_speed(state, file) and file.states[state].rate.strip() not in file.states


def _entry(name: str, file: ModelFile) -> State | Input | Output:
    if name in file.states:
        return file.states[name]
    return file.inputs[name] if name in file.inputs else file.outputs[name]


ALONE: Mapping[str, Callable[[Place, ModelFile], bool]] = {
    "of_position": lambda place, file: place.unit in POSITIONS,
    "of_speed": lambda place, file: is_speed(_state(place, file), file),
    "of_store": lambda place, file: is_store(_state(place, file), file),
}
"""Condition on the place, by `uses`, for effects that use no other quantity."""


def _suits(kind: type[SeamEffect], place: Place, file: ModelFile) -> bool:
    """Return whether an effect may act at a place: by its kind, or with the speed that it uses."""
    return place.kind in kind.acts_on or (kind.uses == "along" and bool(_speed_at(place, file)))


def _speed_at(place: Place, file: ModelFile) -> str:
    """Return the speed that belongs to a place; empty: none is known.

    To the rate of a speed belongs that speed itself.
    """
    if place.kind == SEAM:
        return file.seams[place.name].along
    if place.kind != RATE:
        entry = file.inputs.get(place.name)
        return entry.along if isinstance(entry, DrivenInput) else ""
    state = _state(place, file)
    driven = file.states[state]
    declared = driven.along if isinstance(driven, DrivenState) else ""
    return declared or (state if _positions(state, file) else "")


def _with(place: Place, other: str, file: ModelFile) -> Place:
    size = _entry(other, file).size
    return replace(
        place,
        other=other,
        other_unit=size.si_unit,
        other_size=abs(size.si),
        other_unseen=other == unseen_angle(file),
    )


def acting(entry: ActingEffect, file: ModelFile, where: str) -> SeamEffect:
    """Return an effect that the model file states. Raises InputError."""
    if entry.name not in BY_NAME:
        raise InputError(
            f"no effect {entry.name!r}", where=where, remedy=nearest(entry.name, BY_NAME)
        )
    kind = BY_NAME[entry.name]
    matching = [
        used
        for place in places(file)
        if _suits(kind, place, file) and place.name == entry.at
        for used in _using(kind, place, file)
        if not entry.using or used.other == entry.using
    ]
    if len(matching) != 1:
        allowed = sorted({p.name for p in places(file) if _suits(kind, p, file)})
        using = f" using {entry.using!r}" if entry.using else ""
        raise InputError(
            f"{entry.name} cannot act at {entry.at!r}{using}",
            where=where,
            expected=f"one of {', '.join(allowed) or 'no place of this system'}",
        )
    parameters = [p.name for p in kind.parameters()]
    for name in entry.values:
        if name not in parameters:
            raise InputError(
                f"{entry.name} has no parameter {name!r}",
                where=f"{where}.values",
                expected=", ".join(parameters),
                remedy=nearest(name, parameters),
            )
    try:
        values = {name: number.si for name, number in entry.values.items()}
        return placed(kind, matching[0], file.period)(**values)
    except (TypeError, ParameterError) as fault:
        raise InputError(str(fault), where=where) from fault
