"""Look up the signals of a role map in the database, and convert their values to SI."""

import difflib
from enum import IntEnum

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec.messages import Authority, Phase, TripReason
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import Source
from slipbench.protocol.units import linear


def find_signals(database: Database, role: str, source: Source) -> tuple[Message, list[Signal]]:
    """Message of a role, and its signals that are averaged.

    Raises InputError where the database lacks one, or they belong to several messages.
    """
    messages = [find_message(database, name.partition(".")[0]) for name in source.signals]
    if len({message.name for message in messages}) > 1:
        raise InputError(
            "signals that are averaged must belong to one message",
            where=f"role {role}",
            found=", ".join(source.signals),
            remedy="bind one, or each to a role of its own",
        )
    return messages[0], [find_signal(messages[0], name) for name in source.signals]


def find_message(database: Database, name: str) -> Message:
    """Message of this name. Raises InputError, naming the nearest, where there is none."""
    if name in database.by_name:
        return database.by_name[name]
    near = difflib.get_close_matches(name, database.by_name, n=1, cutoff=0.4)
    raise InputError(
        f"the database has no message {name!r}, which the role map names",
        where=database.origin,
        remedy=f"did you mean {near[0]!r}?" if near else "is it the database of this vehicle?",
    )


def find_signal(message: Message, full_name: str) -> Signal:
    """Signal called "Message.signal" in its message. Raises InputError where there is none."""
    owner, dot, name = full_name.partition(".")
    if not dot or owner != message.name or name not in message.by_name:
        near = difflib.get_close_matches(name, message.by_name, n=1, cutoff=0.0)
        raise InputError(
            f"{full_name!r} in the role map is no signal of message {message.name}",
            expected='"Message.signal"',
            found=", ".join(message.by_name),
            remedy=f'did you mean "{message.name}.{near[0]}"?' if near else "",
        )
    return message.by_name[name]


ENUMERATIONS: dict[str, type[IntEnum]] = {
    "authority": Authority,
    "authority_request": Authority,
    "throttle_authority": Authority,
    "trial_authority": Authority,
    "trial_phase": Phase,
    "trip_reason": TripReason,
}


def meanings(role: str, source: Source, where: str) -> dict[int, int]:
    """Value of each raw value that the file gives a meaning; empty where it gives none.

    Raises InputError for the name of a value that the role does not have.
    """
    found = {}
    members = ENUMERATIONS[role].__members__ if role in ENUMERATIONS else {}
    for raw, value in source.values.items():
        if isinstance(value, int):
            found[int(raw, 0)] = value
        elif value.upper() in members:
            found[int(raw, 0)] = int(members[value.upper()])
        else:
            raise InputError(
                f"{value!r} is no value of this role",
                where=f"{where}: roles.{role}.values",
                expected=", ".join(name.lower() for name in members) or "a whole number",
            )
    return found


def to_si(
    value: npt.NDArray[np.generic], unit: str, role: str, source: Source, target: str
) -> npt.NDArray[np.float64]:
    """Values in the unit `target`, with the role's sign and offset applied, shape (n,).

    value: shape (n,), in the unit of the role map, else in `unit` of the database or table. Raises
    InputError where that unit does not convert to `target`.
    """
    number = np.asarray(value, np.float64)
    stated = unit if source.unit is None else source.unit
    try:
        if target != "count":
            slope, zero = linear(stated, "rad/s" if source.radius else target)
            number = number * (slope * (source.radius or 1.0)) + zero
    except ValueError as cause:
        raise InputError(
            f"the unit {stated!r} does not suit this role",
            where=f"role {role}",
            expected=f"a unit that converts to {target}",
            found=str(cause),
            remedy='state the unit in the role map, as in unit = "km/h"; a wheel speed in'
            " rad/s or rpm needs radius as well",
        ) from cause
    return source.sign * source.scale * number + source.offset
