"""Position of one value in its frame and its conversion to SI, from the database."""

from dataclasses import dataclass
from enum import IntEnum
from math import ceil, floor
from typing import Any

from slipbench.protocol.codec.messages import WRAPPING
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.errors import InputError
from slipbench.protocol.units import linear

SI = {
    "": "",
    "%": "",
    "us": "s",
    "ms": "s",
    "s": "s",
    "deg": "rad",
    "rad": "rad",
    "rpm": "rad/s",
    "rad/s": "rad/s",
    "bar": "Pa",
    "kPa": "Pa",
    "Pa": "Pa",
    "mm": "m",
    "m": "m",
    "degC": "K",
    "K": "K",
    "m/s": "m/s",
    "km/h": "m/s",
    "A": "A",
}


@dataclass(frozen=True, slots=True)
class Slot:
    """Position and conversion of one signal: value in SI = raw * scale + offset.

    low, high: raw values that the database allows. values: of an enumeration or a truth value, by
    raw value. wraps: sent modulo 2^bits, see messages.WRAPPING.
    """

    name: str
    shift: int
    mask: int
    sign: int
    low: int
    high: int
    scale: float
    offset: float
    values: tuple[Any, ...] | None
    wraps: bool

    def pack(self, value: float) -> int:
        """Bits of a value in the frame. Raises ValueError where it does not fit."""
        try:
            raw = round((value - self.offset) / self.scale)
        except (ValueError, OverflowError):
            raise ValueError(f"{self.name} = {value!r} is not a number that can be sent") from None
        if self.wraps:
            return (raw & self.mask) << self.shift
        if not self.low <= raw <= self.high:
            low, high = (limit * self.scale + self.offset for limit in (self.low, self.high))
            raise ValueError(f"{self.name} = {value!r} is not in {low:g} to {high:g} (SI)")
        return (raw & self.mask) << self.shift

    def physical(self, raw: int) -> str:
        """A raw value in SI, as text."""
        return f"{raw * self.scale + self.offset:g}"


def slot(database: Database, message: Message, name: str, kind: type) -> Slot:
    """Slot of one signal that holds a value of type `kind`. Raises InputError where it cannot."""
    if name not in message.by_name:
        raise InputError(
            f"message {message.name} has no signal {name!r}, which the bench needs",
            where=database.origin,
            expected=name,
            found=", ".join(message.by_name),
            remedy="give the signal this name, or give the database of the motorcycle with --dbc",
        )
    signal = message.signal(name)
    where = f"{database.origin}: {message.name}.{name}"
    if not signal.little_endian or signal.is_float:
        raise InputError("the bench's own signals are little-endian integers", where=where)
    scale, offset = (1, 0) if kind is int else si(signal, where)
    low, high = _limits(signal)
    return Slot(
        where,
        signal.start,
        (1 << signal.length) - 1,
        1 << (signal.length - 1) if signal.signed else 0,
        low,
        high,
        scale,
        offset,
        _values(kind, low, high, where),
        signal.wraps or name in WRAPPING,
    )


def si(signal: Signal, where: str) -> tuple[float, float]:
    """Scale and offset from raw value to SI. Raises InputError for a unit unknown here."""
    if signal.unit not in SI:
        known = ", ".join(unit for unit in SI if unit)
        raise InputError(f"unit {signal.unit!r} is unknown here", where=where, expected=known)
    slope, zero = linear(signal.unit, SI[signal.unit])
    return signal.scale * slope, signal.offset * slope + zero


def _limits(signal: Signal) -> tuple[int, int]:
    """Lowest and highest raw value that the database allows; a negative scale exchanges them."""
    low, high = signal.raw_range
    stated = [
        None if physical is None else (physical - signal.offset) / signal.scale
        for physical in (signal.minimum, signal.maximum)
    ]
    least, most = stated if signal.scale > 0 else reversed(stated)
    if least is not None:
        low = max(low, ceil(least - 1e-6))
    if most is not None:
        high = min(high, floor(most + 1e-6))
    return low, high


def _values(kind: type, low: int, high: int, where: str) -> tuple[Any, ...] | None:
    """Members of an enumeration or truth values, by raw value; None for a number.

    The signal must carry every member and nothing else: a member that it cannot carry could not
    be sent, in the middle of a trial. Raises InputError where it does not.
    """
    if kind is bool:
        members = [False, True]
    elif issubclass(kind, IntEnum):
        members = sorted(kind)
    else:
        return None
    if (low, high) != (0, len(members) - 1):
        raise InputError(
            f"the signal carries {low} to {high}",
            where=where,
            expected=f"0 to {len(members) - 1}: "
            + ", ".join(f"{int(member)} {getattr(member, 'name', member)}" for member in members),
            remedy="correct length, minimum and maximum of the signal",
        )
    return tuple(members)
