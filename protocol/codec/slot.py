"""Position of one value in its frame and its conversion to SI, from the database."""

import math
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from math import ceil, floor
from typing import Any

from slipbench.protocol.codec.messages import WRAPPING, Authority
from slipbench.protocol.codec.placement import SignalAt
from slipbench.protocol.codec.protection import bits_of
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
FLOAT_ROUNDING = {16: 1e-3, 32: 1e-6, 64: 1e-12}  # of a limit, by bits: as the wire rounds it
FLOATS = {16: "<e", 32: "<f", 64: "<d"}


@dataclass(frozen=True, slots=True)
class Slot:
    """Position and conversion of one signal: value in SI = raw * scale + offset.

    big: big-endian; `shift` counts from the lowest bit of the payload as one number of that byte
    order. low, high: raw values that the database allows. values: by raw value, of an enumeration or
    a truth value; raws: the first raw value of each. wraps: sent modulo 2^bits, see messages.WRAPPING. real: struct format of a
    floating-point signal, "" for an integer. unknown: raw values that mean "not known".
    """

    name: str
    shift: int
    mask: int
    sign: int
    low: float
    high: float
    scale: float
    offset: float
    values: Mapping[int, Any] | None
    wraps: bool
    big: bool = False
    real: str = ""
    unknown: tuple[float, ...] = ()
    special: bool = False
    raws: Mapping[Any, int] = field(init=False, compare=False, repr=False)

    def __post_init__(self) -> None:
        raws: dict[Any, int] = {}
        for raw, value in (self.values or {}).items():
            raws.setdefault(value, raw)
        object.__setattr__(self, "raws", raws)

    def pack(self, value: float) -> int:
        """Bits of a value in the frame. Raises ValueError where it does not fit."""
        if self.real:
            return self._float_bits(value) << self.shift
        if self.values is not None:
            raw = self._raw_of(value)
        else:
            try:
                raw = round((value - self.offset) / self.scale)
            except (ValueError, OverflowError):
                raise self._no_number(value) from None
        if not (self.wraps or self.low <= raw <= self.high):
            raise self._outside(value)
        return (raw & self.mask) << self.shift

    def _outside(self, value: float) -> ValueError:
        low, high = sorted(limit * self.scale + self.offset for limit in (self.low, self.high))
        return ValueError(f"{self.name} = {value!r} is not in {low:g} to {high:g} (SI)")

    def _no_number(self, value: float) -> ValueError:
        return ValueError(f"{self.name} = {value!r} is not a number that can be sent")

    def read(self, words: tuple[int, int]) -> float | None:
        """Raw value from a payload (see wire.Words); None where it has no meaning."""
        raw = (words[self.big] >> self.shift) & self.mask
        if self.real:
            number = self._float(raw)
            known = math.isfinite(number) and not any(
                math.isclose(number, each, rel_tol=1e-6) for each in self.unknown
            )
            return number if known else None
        if raw & self.sign:
            raw -= self.mask + 1
        known = raw not in self.unknown and (self.values is None or raw in self.values)
        return raw if known else None

    def value(self, raw: float) -> Any:
        """Value in SI, or member of an enumeration, of a raw value."""
        return raw * self.scale + self.offset if self.values is None else self.values[int(raw)]

    def physical(self, raw: float) -> str:
        """A raw value in SI, as text."""
        return f"{raw * self.scale + self.offset:g}"

    def shown(self, words: tuple[int, int]) -> str:
        """What a payload holds here, for a message."""
        raw = (words[self.big] >> self.shift) & self.mask
        if self.real:
            return f"{self._float(raw):g}"
        return self.physical(raw - self.mask - 1 if raw & self.sign else raw)

    @property
    def expected(self) -> str:
        """Range of the values, for a message."""
        if self.real:
            return "a finite number"
        return f"{self.physical(self.low)} to {self.physical(self.high)} (SI)"

    def _raw_of(self, value: Any) -> int:
        found = self.raws.get(value)
        if found is not None:
            return found
        members = self.values or {}
        if isinstance(value, Authority):  # a signal without one actuator encodes the other
            held = [(member, raw) for raw, member in members.items() if member & value == member]
            if held:
                return max(held)[1]
        raise ValueError(f"{self.name} = {value!r} is none of {list(members.values())}")

    def _float_bits(self, value: float) -> int:
        raw = (value - self.offset) / self.scale
        if not math.isfinite(raw):
            raise self._no_number(value)
        if not self.low <= raw <= self.high:
            raise self._outside(value)
        try:
            return int.from_bytes(struct.pack(self.real, raw), "little")
        except (OverflowError, struct.error):
            raise self._no_number(value) from None

    def _float(self, raw: int) -> float:
        size = struct.calcsize(self.real)
        return float(struct.unpack(self.real, raw.to_bytes(size, "little"))[0])


def slot(
    database: Database,
    message: Message,
    name: str,
    kind: type,
    at: SignalAt | None = None,
    *,
    field: str = "",
) -> Slot:
    """Slot of one signal that holds a value of type `kind`.

    at: how a binding converts it; field: of the bench's message, where it has another name. Raises InputError where the signal cannot hold it.
    """
    if name not in message.by_name:
        raise InputError(
            f"message {message.name} has no signal {name!r}, which the bench needs",
            where=database.origin,
            expected=name,
            found=", ".join(message.by_name),
            remedy="give the signal this name, or bind the signals of your database in a binding file",
        )
    signal = message.signal(name)
    where = f"{database.origin}: {message.name}.{name}"
    scale, offset = _conversion(signal, where, kind, at)
    bits = bits_of(signal, message.length)
    low, high = limits(signal)
    return Slot(
        where,
        bits.shift,
        bits.mask,
        1 << (signal.length - 1) if signal.signed else 0,
        low,
        high,
        scale,
        offset,
        _values(kind, low, high, where, at),
        signal.wraps or (field or name) in WRAPPING,
        bits.big,
        FLOATS[signal.length] if signal.is_float else "",
        _unknown(signal, at.unknown if at else ()),
        signal.is_float or bool(at and (at.unknown or at.values)),
    )


def _unknown(signal: Signal, physical: tuple[float, ...]) -> tuple[float, ...]:
    """Raw values that mean "not known"."""
    raw = [(value - signal.offset) / signal.scale for value in physical]
    return tuple(raw if signal.is_float else map(round, raw))


def _conversion(signal: Signal, where: str, kind: type, at: SignalAt | None) -> tuple[float, float]:
    """Scale and offset from raw value to SI, as a binding states them."""
    if at is None:
        return (1, 0) if issubclass(kind, int) else si(signal, where)
    factor = at.sign * at.radius
    if issubclass(kind, int) and (at.values or kind is not int):
        if factor != 1 or at.offset:
            raise InputError(
                "this role is no quantity: it has no sign, scale or offset",
                where=where,
                found=f"sign * scale = {factor:g}, offset = {at.offset:g}",
                remedy='state what each raw value means, as in values = { "0" = 1, "1" = 0 }',
            )
        return 1, 0
    unitless = kind is int
    scale, offset = (signal.scale, signal.offset) if unitless else si(signal, where, at.unit, at.to)
    return scale * factor, offset * factor + at.offset


def si(
    signal: Signal, where: str, unit: str | None = None, to: str | None = None
) -> tuple[float, float]:
    """Scale and offset from raw value to SI. unit: in place of the database's; to: SI unit.

    Raises InputError for a unit that is unknown here, or does not convert to `to`.
    """
    stated = signal.unit if unit is None else unit
    if to is None and stated not in SI:
        known = ", ".join(unit for unit in SI if unit)
        raise InputError(f"unit {stated!r} is unknown here", where=where, expected=known)
    try:
        slope, zero = linear(stated, SI[stated] if to is None else to)
    except ValueError as cause:
        raise InputError(
            f"the unit {stated!r} does not suit this role",
            where=where,
            expected=f"a unit that converts to {to or 'a pure number'}",
            found=str(cause),
            remedy='state the unit in the binding file, as in unit = "km/h"',
        ) from cause
    return signal.scale * slope, signal.offset * slope + zero


def limits(signal: Signal) -> tuple[float, float]:
    """Return the lowest and highest raw value that the database allows.

    A negative scale exchanges its limits.
    """
    low: float
    high: float
    low, high = (-math.inf, math.inf) if signal.is_float else signal.raw_range
    stated = [
        None if physical is None else (physical - signal.offset) / signal.scale
        for physical in (signal.minimum, signal.maximum)
    ]
    least, most = stated if signal.scale > 0 else reversed(stated)
    if signal.is_float:
        rounding = FLOAT_ROUNDING[signal.length]
        low = low if least is None else least - rounding * abs(least)
        return low, high if most is None else most + rounding * abs(most)
    if least is not None:
        low = max(low, ceil(least - 1e-6))
    if most is not None:
        high = min(high, floor(most + 1e-6))
    return low, high


def _values(
    kind: type, low: float, high: float, where: str, at: SignalAt | None
) -> Mapping[int, Any] | None:
    """Members of an enumeration or truth values, by raw value; None for a number.

    The signal must carry every member and nothing else, unless a binding gives the values: a member
    that it cannot carry could not be sent, in the middle of a trial. Raises InputError where it does
    not.
    """
    if at is not None and at.values:
        return _bound_values(kind, low, high, where, at.values)
    if not issubclass(kind, IntEnum | bool):
        return None
    members = _members(kind)
    if (low, high) != (0, len(members) - 1):
        raise InputError(
            f"the signal carries {low:g} to {high:g}",
            where=where,
            expected=f"0 to {len(members) - 1}: "
            + ", ".join(f"{int(member)} {getattr(member, 'name', member)}" for member in members),
            remedy="correct length, minimum and maximum of the signal, or give `values` in a binding file",
        )
    return dict(enumerate(members))


def _bound_values(
    kind: type, low: float, high: float, where: str, values: Mapping[int, int]
) -> Mapping[int, Any]:
    """Members of an enumeration by raw value, as a binding states them."""
    for raw, value in values.items():
        if not low <= raw <= high:
            raise InputError(
                f"`values` names the raw value {raw}, which the signal cannot hold",
                where=where,
                expected=f"{low:g} to {high:g}",
            )
        if issubclass(kind, IntEnum | bool) and value not in {int(each) for each in _members(kind)}:
            raise InputError(
                f"`values` gives raw value {raw} the meaning {value}, which this role does not have",
                where=where,
                expected=", ".join(f"{int(each)} {_named(each)}" for each in _members(kind)),
            )
    return {raw: kind(value) for raw, value in values.items()}


def _members(kind: Any) -> list[Any]:
    return [False, True] if kind is bool else sorted(kind)


def _named(member: Any) -> str:
    return str(getattr(member, "name", member)).lower()
