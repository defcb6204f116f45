"""Where each value of a message lies in its frame, worked out once from the database."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, fields
from enum import IntEnum
from math import ceil, floor
from operator import attrgetter
from typing import Any, get_type_hints

from protocol.errors import InputError
from protocol.faults import Fault, FrameFault
from protocol.layout import Database, Message, Signal
from protocol.messages import BenchMessage, Intervals, ToothIntervals
from protocol.units import linear

SI = {
    "": "", "%": "", "us": "s", "ms": "s", "s": "s", "deg": "rad", "rad": "rad", "rpm": "rad/s",
    "rad/s": "rad/s", "bar": "Pa", "kPa": "Pa", "Pa": "Pa", "mm": "m", "m": "m", "degC": "K",
    "K": "K", "m/s": "m/s", "km/h": "m/s", "A": "A",
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Slot:
    """One signal's place and meaning: value in SI = raw * scale + offset.

    low, high: raw values that the database allows. values: of an enumeration or a truth value, by
    raw value. wraps: sent modulo 2^bits.
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
        """Place a value in the frame's bits. Raises ValueError where it does not fit."""
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

    def told(self, raw: int) -> str:
        """Tell a raw value in SI, for people."""
        return f"{raw * self.scale + self.offset:g}"


def slot(database: Database, message: Message, name: str, kind: type) -> Slot:
    """Work out the place of one signal that holds a value of type `kind`."""
    signal = message.signal(name)
    where = f"{database.origin}: {message.name}.{name}"
    if not signal.little_endian or signal.is_float:
        raise InputError("the bench's own signals are little-endian integers", where=where)
    scale, offset = (1, 0) if kind is int else _si(signal, where)
    low, high = _limits(signal)
    return Slot(
        where, signal.start, (1 << signal.length) - 1,
        1 << (signal.length - 1) if signal.signed else 0,
        low, high, scale, offset, _values(kind, high, where), signal.wraps,
    )  # fmt: skip


def _si(signal: Signal, where: str) -> tuple[float, float]:
    if signal.unit not in SI:
        known = ", ".join(unit for unit in SI if unit)
        raise InputError(f"unit {signal.unit!r} is unknown here", where=where, expected=known)
    slope, zero = linear(signal.unit, SI[signal.unit])
    return signal.scale * slope, signal.offset * slope + zero


def _limits(signal: Signal) -> tuple[int, int]:
    low, high = signal.raw_range
    if signal.minimum is not None:
        low = max(low, ceil((signal.minimum - signal.offset) / signal.scale - 1e-6))
    if signal.maximum is not None:
        high = min(high, floor((signal.maximum - signal.offset) / signal.scale + 1e-6))
    return low, high


def _values(kind: type, high: int, where: str) -> tuple[Any, ...] | None:
    if kind is bool:
        return (False, True)
    if not issubclass(kind, IntEnum):
        return None
    missing = set(range(high + 1)) - {int(member) for member in kind}
    if missing:
        raise InputError(f"{kind.__name__} has no member for {sorted(missing)}", where=where)
    return tuple(kind(number) for number in range(high + 1))


class Plan(ABC):
    """How one message is laid out: identifier, length, data id (None: not protected)."""

    def __init__(self, database: Database, name: str) -> None:
        self.message = database.message(name)
        self.name, self.identifier = name, self.message.identifier
        self.length = self.message.length
        self.data_id = _data_id(database, self.message)

    @abstractmethod
    def pack(self, message: Any) -> int:
        """Lay the message out as one little-endian integer."""

    @abstractmethod
    def unpack(self, word: int) -> BenchMessage | FrameFault:
        """Read the message back."""

    def fault(self, fault: Fault, expected: str, found: str, signal: str = "") -> FrameFault:
        """Name a fault of a frame of this message."""
        return FrameFault(fault, self.name, signal, expected, found)

    def out_of_range(self, slot: Slot, raw: int) -> FrameFault:
        """Name the signal whose value the database does not allow."""
        expected = f"{slot.told(slot.low)} to {slot.told(slot.high)} (SI)"
        return self.fault(Fault.RANGE, expected, slot.told(raw), slot.name.rpartition(".")[2])

    def period(self, field: str) -> float:
        """Tell after how much a clock (s) or a running count wraps."""
        signal = self.message.signal(field)
        return (1 << signal.length) * _si(signal, self.name)[0]


def _data_id(database: Database, message: Message) -> int | None:
    if message.protection is None:
        return None
    header = [message.signal(name) for name in ("crc", "counter")]
    places = [(signal.start, signal.length) for signal in header]
    if message.protection.profile != 1 or places != [(0, 8), (8, 4)]:
        raise InputError(
            f"message {message.name}: end-to-end protection is not laid out as profile 1",
            where=database.origin,
            expected="E2EProfile 1, crc at 0|8, counter at 8|4",
        )
    return message.protection.data_id


class FieldsPlan(Plan):
    """A message whose fields are signals of the same names."""

    def __init__(self, database: Database, name: str, kind: type[BenchMessage]) -> None:
        super().__init__(database, name)
        hints = get_type_hints(kind)
        names = [field.name for field in fields(kind)]
        self._kind: Any = kind
        self._values = attrgetter(*names)
        self._slots = tuple(slot(database, self.message, name, hints[name]) for name in names)

    def pack(self, message: BenchMessage) -> int:
        """Lay the message out as one little-endian integer."""
        word = 0
        for slot_, value in zip(self._slots, self._values(message), strict=True):
            word |= slot_.pack(value)
        return word

    def unpack(self, word: int) -> BenchMessage | FrameFault:
        """Read the message back; a value outside its range is a fault."""
        values = []
        for place in self._slots:
            raw = (word >> place.shift) & place.mask
            if raw & place.sign:
                raw -= place.mask + 1
            if not place.low <= raw <= place.high:
                return self.out_of_range(place, raw)
            table = place.values
            values.append(raw * place.scale + place.offset if table is None else table[raw])
        return self._kind(*values)  # type: ignore[no-any-return]


class TeethPlan(Plan):
    """Tooth intervals: the layout says which signals hold them; an unused one is 0."""

    def __init__(self, database: Database, name: str, kind: type[BenchMessage]) -> None:
        super().__init__(database, name)
        self._layout = slot(database, self.message, "layout", Intervals)
        self._count = slot(database, self.message, "tooth_count", int)
        self._slots = {layout: self._of(database, layout) for layout in Intervals}

    def _of(self, database: Database, layout: Intervals) -> tuple[Slot, ...]:
        present = [
            signal
            for signal in self.message.signals
            if signal.multiplexer == "layout" and int(layout) in signal.multiplexer_ids
        ]
        ordered = sorted(present, key=lambda signal: signal.first_bit)
        return tuple(slot(database, self.message, signal.name, float) for signal in ordered)

    def capacity(self) -> dict[Intervals, tuple[int, float]]:
        """Tell how many intervals each layout holds, and the longest that it can (s)."""
        return {
            layout: (len(slots), slots[0].high * slots[0].scale)
            for layout, slots in self._slots.items()
        }

    def pack(self, message: ToothIntervals) -> int:
        """Lay the message out as one little-endian integer."""
        word = self._layout.pack(message.layout) | self._count.pack(message.tooth_count)
        slots, intervals = self._slots[message.layout], message.intervals
        if not 1 <= len(intervals) <= len(slots):
            raise ValueError(
                f"{self.name}: {len(intervals)} intervals in a {message.layout.name} frame,"
                f" which holds 1 to {len(slots)}"
            )
        for place, interval in zip(slots, intervals, strict=False):
            bits = place.pack(interval)
            if not bits and message.layout is not Intervals.STANDING:
                raise ValueError(f"{place.name} = {interval!r} is less than its resolution")
            word |= bits
        return word

    def unpack(self, word: int) -> BenchMessage | FrameFault:
        """Read the message back; a gap among the intervals is a fault."""
        layout = Intervals((word >> self._layout.shift) & self._layout.mask)
        count = (word >> self._count.shift) & self._count.mask
        slots = self._slots[layout]
        raws = [(word >> place.shift) & place.mask for place in slots]
        used = len(raws) if layout is Intervals.STANDING else _used(raws)
        if not used:
            return self.fault(Fault.RANGE, "intervals, then zeros", str(raws), "layout")
        intervals = tuple(
            raw * place.scale for raw, place in zip(raws[:used], slots[:used], strict=True)
        )
        return ToothIntervals(layout, count, intervals)


def _used(raws: Sequence[int]) -> int:
    """Count the intervals before the first zero; 0 where one follows a zero, or there is none."""
    used = raws.index(0) if 0 in raws else len(raws)
    return 0 if any(raws[used:]) else used
