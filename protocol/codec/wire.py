"""Layout of the bench's messages in the frames of a bus, compiled once from database and placement."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any, Literal, get_type_hints

from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import BenchMessage, Intervals, ToothIntervals
from slipbench.protocol.codec.placement import FieldsAt, SignalAt, TeethAt
from slipbench.protocol.codec.protection import Guard
from slipbench.protocol.codec.slot import Slot, si, slot
from slipbench.protocol.database.layout import Database, Message
from slipbench.protocol.errors import InputError

Words = tuple[int, int]
"""A payload as one number: little-endian, big-endian. A slot takes its bits from `words[slot.big]`."""


Selection = tuple[tuple[str, tuple[int, ...]], ...]
"""Multiplexers of a signal, the outermost first, each with its raw values where the signal is present."""


class FieldsPart:
    """Fields of one message of the bench that lie in one page of a frame.

    whole      all its fields are here, or constant
    selection  of the page; () where no multiplexer selects the fields
    """

    def __init__(
        self,
        database: Database,
        message: Message,
        name: str,
        kind: type[BenchMessage],
        at: FieldsAt,
        selection: Selection = (),
    ) -> None:
        """Compile the fields in one page of `message`. Raises InputError where a signal is missing."""
        hints = get_type_hints(kind)
        self.name, self.message = name, message
        self.kind: Any = kind
        self.fields: list[str] = []
        self.signals = [selector for selector, _ in selection]
        self._slots: list[Slot] = []
        self._valid: list[tuple[str, Slot]] = []
        self.selection = selection
        self._select = [
            (slot(database, message, selector, int), identifiers)
            for selector, identifiers in selection
        ]
        self._constants = {
            key: value for key, value in at.items() if not isinstance(value, SignalAt)
        }
        for field, place in at.items():
            if _lies(place, message, selection):
                assert isinstance(place, SignalAt)
                self._add(database, field, place, hints[field])
        self.whole = {*self.fields, *self._constants} == {each.name for each in fields(kind)}
        order = [each.name for each in fields(kind)]
        self._order = [self.fields.index(key) if key in self.fields else None for key in order]
        self._fixed = [self._constants.get(key) for key in order]
        self._conditions = bool(self._select or self._valid)
        self._plain = self._order == list(range(len(order)))

    def _add(self, database: Database, field: str, place: SignalAt, hint: type) -> None:
        own = place == SignalAt(self.name, field)
        at = None if own else place
        made = slot(database, self.message, place.signal, hint, at, field=field)
        self.fields.append(field)
        self.signals += [place.signal, *([place.valid] if place.valid else [])]
        self._slots.append(made)
        if place.valid:
            self._valid.append((field, slot(database, self.message, place.valid, int)))

    def slot(self, field: str) -> Slot:
        """Slot of one field."""
        return self._slots[self.fields.index(field)]

    def pack(self, message: Any) -> Words:
        """Bits of the message in the frame. Raises ValueError where a value does not fit."""
        words = [0, 0]
        for field, entry in zip(self.fields, self._slots, strict=True):
            words[entry.big] |= entry.pack(getattr(message, field))
        for entry, identifiers in self._select:
            words[entry.big] |= entry.pack(identifiers[0])
        for _, entry in self._valid:
            words[entry.big] |= entry.pack(1)
        return words[0], words[1]

    def unpack(self, words: Words) -> BenchMessage | Mapping[str, Any] | FrameFault | None:
        """The message, or its fields that lie here; or the fault of a value; None where not in the frame."""
        if self._conditions and (found := self._condition(words)) is not True:
            return found
        values = []
        for entry in self._slots:
            raw: Any
            if entry.special:
                raw = entry.read(words)
            else:
                raw = (words[entry.big] >> entry.shift) & entry.mask
                if raw & entry.sign:
                    raw -= entry.mask + 1
            if raw is None or not entry.low <= raw <= entry.high:
                return self._out_of_range(entry, words)
            table = entry.values
            values.append(raw * entry.scale + entry.offset if table is None else table[raw])
        if self._plain:
            return self.kind(*values)  # type: ignore[no-any-return]
        if not self.whole:
            return dict(zip(self.fields, values, strict=True))
        order = zip(self._order, self._fixed, strict=True)
        return self.kind(*[fixed if at is None else values[at] for at, fixed in order])  # type: ignore[no-any-return]

    def _condition(self, words: Words) -> FrameFault | Literal[True] | None:
        """True where the frame holds valid values of the fields; None where it holds other signals."""
        for entry, identifiers in self._select:
            if entry.read(words) not in identifiers:
                return None
        for field, entry in self._valid:
            if not entry.read(words):
                return FrameFault(Fault.RANGE, self.name, field, "a valid value", "not valid")
        return True

    @property
    def constants(self) -> Mapping[str, Any]:
        """Fields that the placement holds constant."""
        return self._constants

    def _out_of_range(self, entry: Slot, words: Words) -> FrameFault:
        name = entry.name.rpartition(".")[2]
        found = entry.shown(words)
        return FrameFault(Fault.RANGE, self.name, name, entry.expected, found)


def selections(message: Message, at: FieldsAt) -> list[Selection]:
    """Pages of a message in which fields of one message of the bench lie."""
    found = [
        selection_of(message, place.signal)
        for place in at.values()
        if isinstance(place, SignalAt) and place.message == message.name
    ]
    return list(dict.fromkeys(found))


def selection_of(message: Message, name: str) -> Selection:
    """Multiplexers of a signal; () where there is none, or no such signal."""
    found: list[tuple[str, tuple[int, ...]]] = []
    signal = message.by_name.get(name)
    while signal is not None and signal.multiplexer:
        found.insert(0, (signal.multiplexer, signal.multiplexer_ids))
        signal = message.by_name.get(signal.multiplexer)
    return tuple(found)


def _lies(place: SignalAt | float, message: Message, selection: Selection) -> bool:
    return (
        isinstance(place, SignalAt)
        and place.message == message.name
        and selection_of(message, place.signal) == selection
    )


class TeethPart:
    """Tooth intervals: the multiplexer selects their signals; an unused one is 0."""

    whole = True
    selection: Selection = ()
    kind: Any = ToothIntervals
    constants: Mapping[str, Any] = {}

    def __init__(self, database: Database, message: Message, name: str, at: TeethAt) -> None:
        """Compile the layouts. Raises InputError where one has no signal."""
        self.name, self.message = name, message
        self.fields = [at.layout, at.count]
        self.signals = list(self.fields)
        self._layout = slot(database, message, at.layout, Intervals)
        self._count = slot(database, message, at.count, int, field="tooth_count")
        self._slots = {layout: self._of(database, layout, at) for layout in Intervals}

    def _of(self, database: Database, layout: Intervals, at: TeethAt) -> tuple[Slot, ...]:
        present = [
            signal
            for signal in self.message.signals
            if signal.multiplexer == at.layout and int(layout) in signal.multiplexer_ids
        ]
        if not present or (layout is Intervals.STANDING and len(present) > 1):
            raise InputError(
                f"message {self.message.name} has {len(present)} signals with the multiplexer "
                f"{at.layout} = {int(layout)} ({layout.name})",
                where=database.origin,
                expected="one" if layout is Intervals.STANDING else "at least one",
                remedy="add the signals to the message, or give the motorcycle's own database",
            )
        self.signals += [signal.name for signal in present]
        ordered = sorted(present, key=lambda signal: signal.first_bit)
        return tuple(
            slot(
                database, self.message, signal.name, float, SignalAt(self.name, signal.name, to="s")
            )
            for signal in ordered
        )

    @property
    def modulo(self) -> int:
        """Modulo of the tooth count."""
        return self._count.mask + 1

    def slot(self, field: str) -> Slot:
        """Slot of the layout or of the count."""
        return self._layout if field == self.fields[0] else self._count

    def capacity(self) -> dict[Intervals, tuple[int, float]]:
        """Number of intervals of each layout, and the longest interval (s)."""
        return {
            layout: (len(slots), slots[0].high * slots[0].scale)
            for layout, slots in self._slots.items()
        }

    def pack(self, message: Any) -> Words:
        """Bits of the message in the frame. Raises ValueError where a value does not fit."""
        slots, intervals = self._slots[message.layout], message.intervals
        if not 1 <= len(intervals) <= len(slots):
            raise ValueError(
                f"{self.name}: {len(intervals)} intervals in a {message.layout.name} frame,"
                f" which holds 1 to {len(slots)}"
            )
        words = [0, 0]
        words[self._layout.big] |= self._layout.pack(message.layout)
        words[self._count.big] |= self._count.pack(message.tooth_count)
        for entry, interval in zip(slots, intervals, strict=False):
            bits = entry.pack(interval)
            if not bits and message.layout is not Intervals.STANDING:
                raise ValueError(f"{entry.name} = {interval!r} is less than its resolution")
            words[entry.big] |= bits
        return words[0], words[1]

    def unpack(self, words: Words) -> BenchMessage | FrameFault:
        """The message, or the fault of a gap among its intervals."""
        raw = self._layout.read(words)
        if raw is None:
            entry = self._layout
            found = entry.shown(words)
            return FrameFault(Fault.RANGE, self.name, self.fields[0], entry.expected, found)
        layout = Intervals(int(raw))
        count = self._count.read(words)
        slots = self._slots[layout]
        raws = [(words[entry.big] >> entry.shift) & entry.mask for entry in slots]
        used = len(raws) if layout is Intervals.STANDING else _used(raws)
        if not used:
            expected = "intervals, then zeros"
            return FrameFault(Fault.RANGE, self.name, self.fields[0], expected, str(raws))
        intervals = tuple(
            raw * entry.scale for raw, entry in zip(raws[:used], slots[:used], strict=True)
        )
        return ToothIntervals(layout, int(count or 0), intervals)


Part = FieldsPart | TeethPart


@dataclass(frozen=True)
class FramePlan:
    """One message of the database: its protection, and what it holds of the bench's messages."""

    message: Message
    guard: Guard | None
    parts: tuple[Part, ...]

    @cached_property
    def counter_period(self) -> int:
        """Number of values of the counter; 1 where there is none."""
        return max(1, self.guard.period if self.guard else 1)

    @cached_property
    def only(self) -> Part | None:
        """The part that a frame consists of; None where there are several, or half a message."""
        return self.parts[0] if len(self.parts) == 1 and self.parts[0].whole else None

    @cached_property
    def pages(self) -> list[tuple[Part, ...]]:
        """Parts that one frame holds, for each page; one page where nothing is multiplexed."""
        selected = dict.fromkeys(part.selection for part in self.parts if part.selection)
        return [
            tuple(part for part in self.parts if _present(part.selection, page))
            for page in selected or [()]
        ]

    def check(self, data: bytes | bytearray) -> bytearray | FrameFault:
        """Payload without bytes beyond the message; or the fault of its length or checksum."""
        length = self.message.length
        if len(data) < length:
            return self.fault(Fault.SHORT, f"{length} bytes", f"{len(data)} bytes")
        payload = bytearray(data[:length])
        if self.guard is not None and not self.guard.intact(payload):
            return self.fault(Fault.CRC, "the CRC of its content", payload[:2].hex())
        return payload

    def words(self, payload: bytearray) -> Words:
        """Payload as a number."""
        return int.from_bytes(payload, "little"), int.from_bytes(payload, "big")

    def payload(self, words: Collection[Words]) -> bytearray:
        """Payload of the bits of several parts."""
        little = big = 0
        for each in words:
            little |= each[0]
            big |= each[1]
        payload = bytearray(little.to_bytes(self.message.length, "little"))
        if big:
            sent = big.to_bytes(self.message.length, "big")
            payload = bytearray(a | b for a, b in zip(payload, sent, strict=True))
        return payload

    def fault(self, fault: Fault, expected: str, found: str) -> FrameFault:
        """Fault of a frame of this message."""
        return FrameFault(fault, self.message.name, "", expected, found)


def _present(selection: Selection, page: Selection) -> bool:
    """Whether fields of a selection are in the frames of a page."""
    sent = {selector: identifiers[0] for selector, identifiers in page}
    return all(sent.get(selector) in identifiers for selector, identifiers in selection)


def period(message: Message, signal: str) -> float:
    """Value at which a clock (s) or a running count wraps."""
    found = message.signal(signal)
    return (1 << found.length) * si(found, f"{message.name}.{signal}")[0]


def _used(raws: Sequence[int]) -> int:
    """Number of intervals before the first zero; 0 where one follows a zero, or there is none."""
    used = raws.index(0) if 0 in raws else len(raws)
    return 0 if any(raws[used:]) else used
