"""Messages and signals of a CAN database, as frozen data."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from slipbench.protocol.errors import InputError


@dataclass(frozen=True)
class Signal:
    """One signal: physical value = raw * scale + offset, in `unit`.

    start           bit as the DBC numbers it: bit 8 * byte + n, n = 0 the byte's lowest; the
                    signal's lowest bit if little-endian, its highest if big-endian
    minimum, maximum physical, None where the database leaves them open
    choices         raw value -> name
    start_value     raw value at power-up
    multiplexer     the signal that states whether this one is present, and the raw values of it
                    (`multiplexer_ids`) for which it is
    wraps           a running count or clock: sent modulo its width, by design
    """

    name: str
    start: int
    length: int
    little_endian: bool = True
    signed: bool = False
    is_float: bool = False
    scale: int | float = 1
    offset: int | float = 0
    minimum: float | None = None
    maximum: float | None = None
    unit: str = ""
    comment: str = ""
    receivers: tuple[str, ...] = ()
    choices: Mapping[int, str] = field(default_factory=dict)
    start_value: int | float | None = None
    is_multiplexer: bool = False
    multiplexer: str | None = None
    multiplexer_ids: tuple[int, ...] = ()
    wraps: bool = False

    @property
    def first_bit(self) -> int:
        """Position of the signal's first bit as that byte order counts.

        Little-endian: bits count from the lowest of byte 0 upwards. Big-endian: in the order in
        which they are sent, from the highest of byte 0 downwards.
        """
        if self.little_endian:
            return self.start
        return 8 * (self.start // 8) + 7 - self.start % 8

    @property
    def raw_range(self) -> tuple[int, int]:
        """Lowest and highest raw value of an integer signal."""
        if self.signed:
            return -(1 << (self.length - 1)), (1 << (self.length - 1)) - 1
        return 0, (1 << self.length) - 1


@dataclass(frozen=True)
class Checksum:
    """Checksum in one byte, over all other bytes of the frame.

    kind        "xor", "sum" or "crc8"
    polynomial  of a CRC, without its highest term
    start       value before the first byte; the share of a constant, such as the identifier
    final_xor   is combined with the result
    """

    signal: str
    kind: str
    polynomial: int = 0x1D
    start: int = 0
    final_xor: int = 0


@dataclass(frozen=True)
class Protection:
    """End-to-end protection of a message.

    profile   AUTOSAR E2E profile: 1, 2 or 5; 0 for a plain counter, checksum, or both
    data_id   of profiles 1 and 5
    data_ids  16 bytes, of profile 2
    counter   name of the counter signal, of profile 0; "" where there is none
    period    number of values of that counter; 0: 2^width
    checksum  of profile 0; None where there is none
    """

    profile: int
    data_id: int = 0
    data_ids: bytes = b""
    counter: str = ""
    period: int = 0
    checksum: Checksum | None = None


@dataclass(frozen=True)
class Message:
    """One message.

    cycle_time  s, the least spacing of event messages, None where unstated
    bus         name of the bus on which it lies, as a role map states it; "" on any
    """

    name: str
    identifier: int
    length: int
    signals: tuple[Signal, ...] = ()
    extended: bool = False
    fd: bool = False
    cycle_time: float | None = None
    senders: tuple[str, ...] = ()
    comment: str = ""
    protection: Protection | None = None
    attributes: Mapping[str, str | int | float] = field(default_factory=dict)
    bus: str = ""

    @cached_property
    def by_name(self) -> Mapping[str, Signal]:
        """Signals by their names."""
        return {signal.name: signal for signal in self.signals}

    def signal(self, name: str) -> Signal:
        """Signal of this name. Raises InputError where there is none."""
        if name not in self.by_name:
            raise InputError(
                f"message {self.name} has no signal {name!r}", expected=", ".join(self.by_name)
            )
        return self.by_name[name]


@dataclass(frozen=True)
class Database:
    """One database file. sha256: of the file's bytes, hexadecimal."""

    origin: str
    sha256: str
    messages: tuple[Message, ...]
    nodes: tuple[str, ...] = ()

    @cached_property
    def by_name(self) -> Mapping[str, Message]:
        """Messages by their names."""
        return {message.name: message for message in self.messages}

    def message(self, name: str) -> Message:
        """Message of this name. Raises InputError where there is none."""
        if name not in self.by_name:
            raise InputError(
                f"the database has no message {name!r}",
                where=self.origin,
                expected="one of " + ", ".join(self.by_name),
                remedy="give the message this name, or give the right database",
            )
        return self.by_name[name]

    def on_buses(self, bus_of: "BusOf") -> "Database":
        """The same messages, each on its bus."""
        messages = tuple(replace(each, bus=bus_of(each.name)) for each in self.messages)
        return self if messages == self.messages else replace(self, messages=messages)


BusOf = Callable[[str], str]
"""Name of the bus of a message, by the message's name; "" on any."""


def any_bus(_message: str) -> str:
    """State no bus: the message may lie on any."""
    return ""
