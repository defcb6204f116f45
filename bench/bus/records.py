"""Protocol between the broker of a bus and its nodes: one record in each packet.

A record has a head of fixed size, then a payload of up to 64 bytes or a JSON text. Times are those of
the monotonic clock of the machine, which all its processes share.
"""

import json
import socket
import struct
from dataclasses import asdict, dataclass
from enum import IntEnum
from typing import NamedTuple

from slipbench.bench.bus.counters import Confinement
from slipbench.bench.bus.error_frames import BUS_OFF, CONTROLLER, OVERFLOW, error_content
from slipbench.bench.bus.events import Delivery, Notice
from slipbench.bench.bus.faults import LONGEST
from slipbench.bench.bus.frame import Frame, checked

HEAD = struct.Struct("=BBBBIqQ")
FASTEST = 20_000_000  # bit/s
LARGEST = 1 << 16  # bytes of a record: a fault plan
EXTENDED, REMOTE, FD, SWITCHES_RATE, ERROR_PASSIVE, OWN = 1, 2, 4, 8, 16, 32


class Kind(IntEnum):
    """Type of a record; nodes send the first four."""

    HELLO = 1
    FRAME = 2
    RESTART = 3
    FAULTS = 4
    WELCOME = 5
    REFUSED = 6
    ERROR = 7


class Record(NamedTuple):
    """One record.

    detail    frame: payload length that a remote frame requests; error: state (`Confinement`)
    number    frame: identifier; error: error class of SocketCAN
    time_ns   time of sending or of arrival
    busy_ns   frame: time for which the wire has been busy; error: number of dropped frames
    """

    kind: Kind
    flags: int
    detail: int
    number: int
    time_ns: int
    busy_ns: int
    content: bytes


@dataclass(frozen=True)
class Hello:
    """Request of a node to join: its name, its transmit queue, and bit rates in bit/s."""

    name: str
    bitrate: int
    data_bitrate: int
    fd: bool
    restart_after: float | None
    room: int
    urgent_first: bool

    def text(self) -> bytes:
        """JSON text of the request."""
        return json.dumps(asdict(self)).encode()

    @classmethod
    def read(cls, text: bytes) -> "Hello":
        """Request of a JSON text. Raises ValueError or TypeError where it is not valid."""
        try:
            document = json.loads(text)
        except RecursionError as cause:
            raise ValueError("not a valid HELLO") from cause
        hello = cls(**document) if isinstance(document, dict) else None
        if hello is None or not hello.valid:
            raise ValueError(f"not a valid HELLO: {document!r:.200}")
        return hello

    @property
    def valid(self) -> bool:
        """Whether all values are of the right type and within their bounds."""
        counts = (self.bitrate, self.data_bitrate, self.room)
        wait = self.restart_after
        return (
            all(type(count) is int and 0 < count <= FASTEST for count in counts)
            and isinstance(self.name, str)
            and (wait is None or (isinstance(wait, int | float) and 0 <= wait <= LONGEST))
        )


def received(link: socket.socket) -> bytes:
    """Next record, or b"" where the other side has left and all its records were read.

    A process that leaves with unread records resets the connection. The reset is reported once,
    before the records that it sent; these may release authority, and must be read.
    """
    try:
        return link.recv(LARGEST)
    except ConnectionResetError:
        return link.recv(LARGEST)


def packed(kind: Kind, content: bytes = b"", time_ns: int = 0) -> bytes:
    """Packet of a record that is not a frame."""
    return HEAD.pack(kind, 0, 0, 0, 0, time_ns, 0) + content


def packed_frame(frame: Frame, time_ns: int, own: bool = False, busy_ns: int = 0) -> bytes:
    """Packet of a frame."""
    flags = (
        (EXTENDED if frame.extended else 0)
        | (FD if frame.fd else 0)
        | (SWITCHES_RATE if frame.switches_rate else 0)
        | (ERROR_PASSIVE if frame.error_passive else 0)
        | (OWN if own else 0)
    )
    requested = 0
    if frame.requested is not None:
        flags, requested = flags | REMOTE, frame.requested
    head = HEAD.pack(Kind.FRAME, flags, requested, 0, frame.identifier, time_ns, busy_ns)
    return head + frame.data


def packed_delivery(delivery: Delivery, busy_ns: int) -> bytes:
    """Packet of a frame that a node receives."""
    return packed_frame(delivery.frame, delivery.time_ns, delivery.own, busy_ns)


def packed_notice(notice: Notice) -> bytes:
    """Packet of a notice to a node."""
    number, data = error_content(notice.cause, notice.counters, notice.sending)
    state = notice.counters.state
    return HEAD.pack(Kind.ERROR, 0, state, 0, number, notice.time_ns, notice.dropped) + data


def packed_refusal(state: Confinement, time_ns: int) -> bytes:
    """Packet that reports a dropped frame: its sender is bus-off or its queue is full."""
    number = BUS_OFF if state is Confinement.OFF else 0
    return HEAD.pack(Kind.ERROR, 0, state, 0, number | CONTROLLER, time_ns, 1) + bytes(8)


def packed_overflow(state: Confinement, time_ns: int) -> bytes:
    """Packet that reports lost frames, because the node did not read."""
    details = bytes((0, OVERFLOW, 0, 0, 0, 0, 0, 0))
    return HEAD.pack(Kind.ERROR, 0, state, 0, CONTROLLER, time_ns, 0) + details


def unpacked(packet: bytes) -> Record:
    """Record of a packet. Raises ValueError where it is not valid."""
    if len(packet) < HEAD.size:
        raise ValueError(f"a record has at least {HEAD.size} bytes, not {len(packet)}")
    kind, flags, detail, _, number, time_ns, busy_ns = HEAD.unpack_from(packet)
    return Record(Kind(kind), flags, detail, number, time_ns, busy_ns, packet[HEAD.size :])


def frame_in(record: Record) -> Frame:
    """Frame of a record. Raises ValueError where no CAN controller can send it."""
    flags = record.flags
    return checked(
        Frame(
            record.number,
            record.content,
            bool(flags & EXTENDED),
            bool(flags & FD),
            bool(flags & SWITCHES_RATE),
            bool(flags & ERROR_PASSIVE),
            record.detail if flags & REMOTE else None,
        )
    )


def state_in(record: Record) -> Confinement:
    """State of the node in an error record."""
    return Confinement(record.detail)
