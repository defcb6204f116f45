"""What a broker of a bus and its nodes tell each other: one record, one packet.

A head of fixed size, then up to 64 bytes of payload, or the JSON text of what is said once. Times
are of the machine's monotonic clock, which all its processes share.
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
LARGEST = 1 << 16  # bytes of a record: a plan of faults
EXTENDED, REMOTE, FD, SWITCHES_RATE, ERROR_PASSIVE, OWN = 1, 2, 4, 8, 16, 32


class Kind(IntEnum):
    """What a record says; nodes say the first four."""

    HELLO = 1
    FRAME = 2
    RESTART = 3
    FAULTS = 4
    WELCOME = 5
    REFUSED = 6
    ERROR = 7


class Record(NamedTuple):
    """One record.

    detail    of a frame, what a remote one asks for; of an error, the node's `Confinement`
    number    of a frame, its identifier; of an error, SocketCAN's class
    time_ns   when it was sent, or arrived
    busy_ns   how long the wire had been busy until then; of an error, the frames that it dropped
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
    """Who wants to join, how it sends, and at which rates the bus must run (bit/s)."""

    name: str
    bitrate: int
    data_bitrate: int
    fd: bool
    restart_after: float | None
    room: int
    urgent_first: bool

    def text(self) -> bytes:
        """Write it as JSON."""
        return json.dumps(asdict(self)).encode()

    @classmethod
    def read(cls, text: bytes) -> "Hello":
        """Read it; raises ValueError or TypeError for what is none."""
        try:
            told = json.loads(text)
        except RecursionError as cause:
            raise ValueError("this is no hello") from cause
        hello = cls(**told) if isinstance(told, dict) else None
        if hello is None or not hello.sensible:
            raise ValueError(f"this is no hello: {told!r:.200}")
        return hello

    @property
    def sensible(self) -> bool:
        """Tell whether a wire can do what this asks for."""
        counts = (self.bitrate, self.data_bitrate, self.room)
        wait = self.restart_after
        return (
            all(type(count) is int and 0 < count <= FASTEST for count in counts)
            and isinstance(self.name, str)
            and (wait is None or (isinstance(wait, int | float) and 0 <= wait <= LONGEST))
        )


def received(link: socket.socket) -> bytes:
    """Receive a record, or b"" where the other side has left and all that it sent is here.

    Who leaves without having read everything resets the connection. That is told once, and before
    the records that it sent, which may be what hands a vehicle back.
    """
    try:
        return link.recv(LARGEST)
    except ConnectionResetError:
        return link.recv(LARGEST)


def packed(kind: Kind, content: bytes = b"", time_ns: int = 0) -> bytes:
    """Write a record that is no frame."""
    return HEAD.pack(kind, 0, 0, 0, 0, time_ns, 0) + content


def packed_frame(frame: Frame, time_ns: int, own: bool = False, busy_ns: int = 0) -> bytes:
    """Write a frame."""
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
    """Write what a node hears."""
    return packed_frame(delivery.frame, delivery.time_ns, delivery.own, busy_ns)


def packed_notice(notice: Notice) -> bytes:
    """Write what a node is told beside frames."""
    number, data = error_content(notice.cause, notice.counters, notice.sending)
    state = notice.counters.state
    return HEAD.pack(Kind.ERROR, 0, state, 0, number, notice.time_ns, notice.dropped) + data


def packed_refusal(state: Confinement, time_ns: int) -> bytes:
    """Write that a node's frame was dropped, for the node is off the bus or its queue is full."""
    number = BUS_OFF if state is Confinement.OFF else 0
    return HEAD.pack(Kind.ERROR, 0, state, 0, number | CONTROLLER, time_ns, 1) + bytes(8)


def packed_overflow(state: Confinement, time_ns: int) -> bytes:
    """Write that frames were lost because the node did not read."""
    details = bytes((0, OVERFLOW, 0, 0, 0, 0, 0, 0))
    return HEAD.pack(Kind.ERROR, 0, state, 0, CONTROLLER, time_ns, 0) + details


def unpacked(packet: bytes) -> Record:
    """Read a record; raises ValueError for what is none."""
    if len(packet) < HEAD.size:
        raise ValueError(f"{len(packet)} bytes are no record")
    kind, flags, detail, _, number, time_ns, busy_ns = HEAD.unpack_from(packet)
    return Record(Kind(kind), flags, detail, number, time_ns, busy_ns, packet[HEAD.size :])


def frame_in(record: Record) -> Frame:
    """Give the frame of a record; raises ValueError for what no controller can send."""
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
    """Give the state of the node that an error record tells."""
    return Confinement(record.detail)
