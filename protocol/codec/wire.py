"""Layout of each message of the bench in its frame, compiled once from the database."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import fields
from operator import attrgetter
from typing import Any, get_type_hints

from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import BenchMessage, Intervals, ToothIntervals
from slipbench.protocol.codec.slot import Slot, si, slot
from slipbench.protocol.database.layout import Database, Message
from slipbench.protocol.errors import InputError


class Plan(ABC):
    """Layout of one message: identifier, length, data id (None: not protected)."""

    def __init__(self, database: Database, name: str) -> None:
        self.message = database.message(name)
        if self.message.extended:
            raise InputError(
                f"message {name} has a 29-bit identifier",
                where=database.origin,
                expected="an 11-bit identifier: the bench sends and decodes no other",
                remedy="change the identifier of the message",
            )
        self.name, self.identifier = name, self.message.identifier
        self.length = self.message.length
        self.data_id = _data_id(database, self.message)

    @abstractmethod
    def pack(self, message: Any) -> int:
        """Payload of the message as one little-endian integer. Raises ValueError where a value does not fit."""

    @abstractmethod
    def unpack(self, word: int) -> BenchMessage | FrameFault:
        """Message of a payload given as a little-endian integer, or its fault."""

    def fault(self, fault: Fault, expected: str, found: str, signal: str = "") -> FrameFault:
        """Fault of a frame of this message."""
        return FrameFault(fault, self.name, signal, expected, found)

    def out_of_range(self, slot: Slot, raw: int) -> FrameFault:
        """Fault of a signal whose value the database does not allow."""
        expected = f"{slot.physical(slot.low)} to {slot.physical(slot.high)} (SI)"
        return self.fault(Fault.RANGE, expected, slot.physical(raw), slot.name.rpartition(".")[2])

    def period(self, field: str) -> float:
        """Value at which a clock (s) or a running count wraps."""
        signal = self.message.signal(field)
        return (1 << signal.length) * si(signal, f"{self.name}.{field}")[0]


def _data_id(database: Database, message: Message) -> int | None:
    if message.protection is None:
        if not {"crc", "counter"} <= message.by_name.keys():
            return None
        raise InputError(
            f"message {message.name} has crc and counter, but no end-to-end protection is declared",
            where=database.origin,
            expected="the message attributes E2EProfile and E2EDataId",
            remedy="add both attributes to the message: without them no CRC would be checked",
        )
    header = [message.signal(name) for name in ("crc", "counter")]
    positions = [(signal.start, signal.length) for signal in header]
    if message.protection.profile != 1 or positions != [(0, 8), (8, 4)]:
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
        """Payload of the message as one little-endian integer. Raises ValueError where a value does not fit."""
        word = 0
        for slot_, value in zip(self._slots, self._values(message), strict=True):
            word |= slot_.pack(value)
        return word

    def unpack(self, word: int) -> BenchMessage | FrameFault:
        """Message of a payload, or the fault of a value outside its range."""
        values = []
        for entry in self._slots:
            raw = (word >> entry.shift) & entry.mask
            if raw & entry.sign:
                raw -= entry.mask + 1
            if not entry.low <= raw <= entry.high:
                return self.out_of_range(entry, raw)
            table = entry.values
            values.append(raw * entry.scale + entry.offset if table is None else table[raw])
        return self._kind(*values)  # type: ignore[no-any-return]


class TeethPlan(Plan):
    """Tooth intervals: the multiplexer `layout` selects their signals; an unused one is 0."""

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
        if not present or (layout is Intervals.STANDING and len(present) > 1):
            raise InputError(
                f"message {self.name} has {len(present)} signals with the multiplexer layout = "
                f"{int(layout)} ({layout.name})",
                where=database.origin,
                expected="one" if layout is Intervals.STANDING else "at least one",
                remedy="add the signals to the message, or give the motorcycle's own database",
            )
        ordered = sorted(present, key=lambda signal: signal.first_bit)
        return tuple(slot(database, self.message, signal.name, float) for signal in ordered)

    def capacity(self) -> dict[Intervals, tuple[int, float]]:
        """Number of intervals of each layout, and the longest interval (s)."""
        return {
            layout: (len(slots), slots[0].high * slots[0].scale)
            for layout, slots in self._slots.items()
        }

    def pack(self, message: ToothIntervals) -> int:
        """Payload of the message as one little-endian integer. Raises ValueError where a value does not fit."""
        word = self._layout.pack(message.layout) | self._count.pack(message.tooth_count)
        slots, intervals = self._slots[message.layout], message.intervals
        if not 1 <= len(intervals) <= len(slots):
            raise ValueError(
                f"{self.name}: {len(intervals)} intervals in a {message.layout.name} frame,"
                f" which holds 1 to {len(slots)}"
            )
        for entry, interval in zip(slots, intervals, strict=False):
            bits = entry.pack(interval)
            if not bits and message.layout is not Intervals.STANDING:
                raise ValueError(f"{entry.name} = {interval!r} is less than its resolution")
            word |= bits
        return word

    def unpack(self, word: int) -> BenchMessage | FrameFault:
        """Message of a payload, or the fault of a gap among its intervals."""
        raw = (word >> self._layout.shift) & self._layout.mask
        if not self._layout.low <= raw <= self._layout.high:
            return self.out_of_range(self._layout, raw)
        layout = Intervals(raw)
        count = (word >> self._count.shift) & self._count.mask
        slots = self._slots[layout]
        raws = [(word >> entry.shift) & entry.mask for entry in slots]
        used = len(raws) if layout is Intervals.STANDING else _used(raws)
        if not used:
            return self.fault(Fault.RANGE, "intervals, then zeros", str(raws), "layout")
        intervals = tuple(
            raw * entry.scale for raw, entry in zip(raws[:used], slots[:used], strict=True)
        )
        return ToothIntervals(layout, count, intervals)


def _used(raws: Sequence[int]) -> int:
    """Number of intervals before the first zero; 0 where one follows a zero, or there is none."""
    used = raws.index(0) if 0 in raws else len(raws)
    return 0 if any(raws[used:]) else used
