"""Frames from messages and messages from frames: SI inside, the units of the database on the wire."""

from collections.abc import Mapping
from enum import IntEnum
from typing import Any, NamedTuple

from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import Authority, BenchMessage, Intervals
from slipbench.protocol.codec.placement import (
    BENCH_SENDS,
    KINDS,
    MESSAGES,
    OWN,
    FieldsAt,
    Placement,
    TeethAt,
    buses_of,
    carriers_of,
)
from slipbench.protocol.codec.protection import guard_of
from slipbench.protocol.codec.wire import (
    FieldsPart,
    FramePlan,
    Part,
    TeethPart,
    Words,
    period,
    selections,
)
from slipbench.protocol.database.layout import Database, Message
from slipbench.protocol.errors import InputError

REQUEST = "ActuatorCommand"
__all__ = ["MESSAGES", "Codec", "Frame", "Sender"]


class Frame(NamedTuple):
    """A frame to be sent. bus: number of its bus, see `Codec.buses`."""

    identifier: int
    data: bytes
    extended: bool = False
    bus: int = 0


class Codec:
    """Encodes and decodes the bench's messages as one database lays them out.

    A message is named by its class; tooth intervals and encoder statuses, which both encoders
    send, by wheel: "RearTeeth", "FrontEncoderStatus". With a placement from a binding, a frame can hold
    fields of several messages, and a message can lie in several frames.

    buses  names of the buses on which these messages lie, sorted; ("",) for one without a name.
           The number of a bus is its place there
    """

    def __init__(self, database: Database, placement: Placement = OWN) -> None:
        """Compile the database. Raises InputError where it lacks a message or signal that is placed."""
        self.placement, self.origin = placement, database.origin
        if placement == OWN:
            for name in placement:
                _require_own(database, database.message(name))
        held: dict[str, list[Part]] = {}
        self._parts_of: dict[str, list[Part]] = {}
        for name, at in placement.items():
            for carrier in carriers_of(at):
                parts = _parts(database, database.message(carrier), name, at)
                held.setdefault(carrier, []).extend(parts)
                self._parts_of.setdefault(name, []).extend(parts)
        self._plans = {
            carrier: _plan(database, database.message(carrier), tuple(parts))
            for carrier, parts in held.items()
        }
        self._require_one_page()
        self._require_every_member()
        self.buses = buses_of(database, placement)
        self._bus_of = {name: self._number(plan) for name, plan in self._plans.items()}
        self._by_key = {(*key_of(p.message), self._number(p)): p for p in self._plans.values()}

    def encode(
        self, message: BenchMessage, *, counter: int = 0, name: str | None = None
    ) -> tuple[int, bytes]:
        """Identifier and payload of a message that lies in one frame, with its end-to-end protection.

        counter: of its end-to-end protection, see `Sender`. Clocks and running counts wrap at
        their signals' widths. Raises ValueError for any other value that its signal cannot hold.
        """
        key = name or type(message).__name__
        plan = self._plans[self.carriers(key)[0]]
        words = [part.pack(message) for part in self.parts(key) if part.message is plan.message]
        frame = self.finish(plan, words, counter)
        return frame.identifier, frame.data

    def finish(self, plan: FramePlan, words: list[Words], counter: int) -> Frame:
        """Frame of the bits of its parts, protected."""
        payload = plan.payload(words)
        if plan.guard is not None:
            plan.guard.protect(payload, counter % plan.counter_period)
        message = plan.message
        return Frame(
            message.identifier, bytes(payload), message.extended, self._bus_of[message.name]
        )

    def plan(self, identifier: int, extended: bool = False, bus: int = 0) -> FramePlan | None:
        """Layout of the frames with this identifier on the bus of this number.

        None where they hold nothing of the bench's.
        """
        return self._by_key.get((identifier, extended, bus))

    def plan_of(self, carrier: str) -> FramePlan:
        """Layout of a message of the database. Raises KeyError where it holds nothing of the bench's."""
        return self._plans[carrier]

    def decode(
        self, identifier: int, data: bytes | bytearray, extended: bool = False, bus: int = 0
    ) -> BenchMessage | FrameFault:
        """Message of a frame that holds one whole message, or its fault. bus: its number.

        The CRC is checked, bytes beyond the message are ignored. Of a frame that holds more, see
        `slipbench.protocol.codec.assembly`.
        """
        plan = self.plan(identifier, extended, bus)
        if plan is None:
            return FrameFault(Fault.UNKNOWN, expected="one of the bench's", found=hex(identifier))
        payload = plan.check(data)
        if isinstance(payload, FrameFault):
            return payload
        found = plan.parts[0].unpack(plan.words(payload))
        if isinstance(found, Mapping) or found is None:
            return plan.fault(Fault.UNKNOWN, "a whole message of the bench", "a part of one")
        return found

    def counter(
        self, identifier: int, data: bytes | bytearray, extended: bool = False
    ) -> int | None:
        """Counter of a whole frame; None where the message is not protected."""
        plan = self.plan(identifier, extended)
        if plan is None or plan.guard is None or len(data) < plan.message.length:
            return None
        return plan.guard.counter(data)

    def identifier(self, name: str) -> int:
        """Identifier of the first frame of a message of the bench."""
        return self._plans[self.carriers(name)[0]].message.identifier

    def name(self, identifier: int, extended: bool = False) -> str | None:
        """Name of the message with this identifier in the database; None where it is unknown."""
        plan = self.plan(identifier, extended)
        return plan.message.name if plan else None

    def carriers(self, name: str) -> list[str]:
        """Messages of the database that hold a message of the bench. Raises InputError where none does."""
        return list(dict.fromkeys(part.message.name for part in self.parts(name)))

    def has(self, name: str) -> bool:
        """Whether the database holds a message of the bench."""
        return name in self._parts_of

    @property
    def requests_authority(self) -> bool:
        """Whether a signal requests authority; without one, requests that end release it."""
        parts = self.parts(REQUEST) if self.has(REQUEST) else []
        return any("authority" in part.fields for part in parts)

    @property
    def plans(self) -> Mapping[str, FramePlan]:
        """Layout of each message of the database that holds something of the bench's, by name."""
        return self._plans

    def parts(self, name: str) -> list[Part]:
        """Parts of a message of the bench, one for each frame, and page of it, that holds some of it.

        Raises InputError where none does.
        """
        if name not in self._parts_of:
            known = ", ".join(self._parts_of)
            raise InputError(f"no message {name!r}", expected=known)
        return self._parts_of[name]

    def _number(self, plan: FramePlan) -> int:
        return self.buses.index(plan.message.bus)

    def _require_every_member(self) -> None:
        """Check that what the bench sends can show each of its values, and a request its end."""
        for name in BENCH_SENDS:
            for part in self._parts_of.get(name, ()):
                for field in part.fields:
                    carried = part.slot(field)
                    members = list((carried.values or {}).values())
                    missing = _unsent(members)
                    if missing:
                        raise InputError(
                            f"{carried.name} cannot show {missing}, which the bench sends",
                            expected="`values` that name every value of this role",
                            found=", ".join(member.name.lower() for member in members),
                            remedy="add the values to the role in the binding file",
                        )

    def _require_one_page(self) -> None:
        """Check that one frame carries a full request; else the ECU mixes old and new values."""
        for part in self._parts_of.get(REQUEST, ()):
            plan = self._plans[part.message.name]
            if sum(any(held.name == REQUEST for held in page) for page in plan.pages) > 1:
                raise InputError(
                    f"the requests lie in several pages of the multiplexed message {part.message.name}",
                    where=self.origin,
                    expected="all requests of a message in one page",
                    found="; ".join(_page(each) for each in self._parts_of[REQUEST]),
                )

    def period(self, name: str, field: str) -> float:
        """Value at which a clock (s) or a running count wraps."""
        return period(self._plans[self.carriers(name)[0]].message, field)

    def capacity(self, name: str) -> Mapping[Intervals, tuple[int, float]]:
        """Number of intervals in a tooth frame of each layout, and the longest interval (s)."""
        part = self.parts(name)[0]
        return part.capacity() if isinstance(part, TeethPart) else {}


def key_of(message: Message) -> tuple[int, bool]:
    """Identifier of a message, and whether it is a 29-bit one."""
    return message.identifier, message.extended


def _unsent(members: list[Any]) -> str:
    """Members of an enumeration that its signal cannot encode; an Authority requires NONE only."""
    if not members or not isinstance(members[0], IntEnum):
        return ""
    kind = type(members[0])
    needed = [Authority.NONE] if kind is Authority else list(kind)
    return ", ".join(each.name.lower() for each in needed if each not in members)


def _parts(database: Database, message: Message, name: str, at: FieldsAt | TeethAt) -> list[Part]:
    """What a message of the database holds of one of the bench's, page by page."""
    if isinstance(at, TeethAt):
        return [TeethPart(database, message, name, at)]
    return [
        FieldsPart(database, message, name, KINDS[name], at, selection)
        for selection in selections(message, at)
    ]


def _page(part: Part) -> str:
    pages = [f"{selector} = {identifiers[0]}" for selector, identifiers in part.selection]
    return f"{', '.join(part.fields)} ({' and '.join(pages) or 'every page'})"


def _plan(database: Database, message: Message, parts: tuple[Part, ...]) -> FramePlan:
    used = [name for part in parts for name in part.signals]
    return FramePlan(message, guard_of(message, used, database.origin), parts)


def _require_own(database: Database, message: Message) -> None:
    """Check a message of the bench's own database. Raises InputError where the bench cannot use it."""
    if message.extended:
        raise InputError(
            f"message {message.name} has a 29-bit identifier",
            where=database.origin,
            expected="an 11-bit identifier in the bench's own database",
            remedy="change the identifier of the message, or use a binding file",
        )
    if message.protection is None:
        if not {"crc", "counter"} <= message.by_name.keys():
            return
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


class Sender:
    """Sending side of a node: the next counter of each frame, and what the others of its parts hold."""

    def __init__(self, codec: Codec) -> None:
        self.counters: dict[str, int] = {}
        self._codec = codec
        self._outlets = {
            name: _Outlet(codec, plan, self.counters) for name, plan in codec.plans.items()
        }
        self._routes: dict[str, _Route] = {}

    def encode(self, message: BenchMessage, *, name: str | None = None) -> tuple[int, bytes]:
        """Identifier and payload of a message that lies in one frame. Raises ValueError as `Codec.encode` does."""
        frame = self.frames(message, name=name)[0]
        return frame.identifier, frame.data

    def frames(
        self, message: BenchMessage, *, name: str | None = None, now: float | None = None
    ) -> list[Frame]:
        """Frames to send for a message, with their next counters.

        now: s; a frame whose cycle time is not over yet keeps what it holds until the next message.
        None: every frame is sent. Raises ValueError as `Codec.encode` does.
        """
        key = name or type(message).__name__
        parts, outlets = self._routes.get(key) or self._route(key)
        words = [part.pack(message) for part, _, _ in parts]
        for (_, outlet, place), each in zip(parts, words, strict=True):
            outlet.held[place] = each
        if len(outlets) == 1:
            return outlets[0].frames(key, now)
        return [frame for outlet in outlets for frame in outlet.frames(key, now)]

    def _route(self, key: str) -> "_Route":
        """Parts of a message of the bench, each with its outlet and its place there; all outlets."""
        parts = []
        for part in self._codec.parts(key):
            outlet = self._outlets[part.message.name]
            parts.append((part, outlet, outlet.plan.parts.index(part)))
        self._routes[key] = parts, list(dict.fromkeys(outlet for _, outlet, _ in parts))
        return self._routes[key]


class _Outlet:
    """One message of the database at its sender: what its parts hold, its pages, its cycle time."""

    def __init__(self, codec: Codec, plan: FramePlan, counters: dict[str, int]) -> None:
        self._codec = codec
        self.plan, self._counters, self._carrier = plan, counters, plan.message.name
        self.held: list[Words | None] = [None] * len(plan.parts)
        self._event = plan.message.attributes.get("GenMsgSendType") == 1
        self._pages = [[plan.parts.index(part) for part in page] for page in plan.pages]
        self._turn = 0
        self._spacing = (plan.message.cycle_time or 0.0) - HALF_TICK
        self._sent_at: float | None = None

    def frames(self, key: str, now: float | None) -> list[Frame]:
        """Frames for message `key` of the bench; pages take turns where there is a cycle time."""
        due = None if self._event else now
        pages = self._pages
        if len(pages) > 1:
            pages = self._pages_of(key) if due is None else [pages[self._turn % len(pages)]]
        made = []
        for page in pages:
            words = [each for place in page if (each := self.held[place]) is not None]
            if len(words) < len(page) or (due is not None and not self._due(due)):
                continue
            self._turn += 1
            made.append(self._next(words))
        return made

    def _pages_of(self, key: str) -> list[list[int]]:
        parts = self.plan.parts
        return [page for page in self._pages if any(parts[place].name == key for place in page)]

    def _next(self, words: list[Words]) -> Frame:
        """Frame under the next counter."""
        counter = self._counters.get(self._carrier, 0)
        self._counters[self._carrier] = (counter + 1) % self.plan.counter_period
        return self._codec.finish(self.plan, words, counter)

    def _due(self, now: float) -> bool:
        """Whether the cycle time of a frame is over at `now` (s)."""
        if self._sent_at is not None and now - self._sent_at < self._spacing:
            return False
        self._sent_at = now
        return True


_Route = tuple[list[tuple[Part, _Outlet, int]], list[_Outlet]]
HALF_TICK = 0.0005  # s
