"""Broker: a process that simulates a CAN bus in real time for nodes in other processes.

Nodes connect through a local socket. The time of the wire advances from frame to frame, so that
lateness of this process delays a delivery but never accumulates; time stamps are those of the wire.
Senders stamp their frames. A frame takes part in arbitration from its stamp on, if it arrives here
before the wire has advanced further.

The first node starts the broker; it ends shortly after the last node has left. Linux only: the address
of the socket is abstract, so that no file remains, and only the same user may connect.
"""

import os
import select
import socket
import struct
import sys
import time
from collections import deque

from slipbench.bench.bus.counters import Confinement
from slipbench.bench.bus.events import Delivery
from slipbench.bench.bus.frame import BitRates
from slipbench.bench.bus.node import Node
from slipbench.bench.bus.plan_text import read_plan
from slipbench.bench.bus.queues import InOrder, MostUrgent
from slipbench.bench.bus.records import (
    Hello,
    Kind,
    Record,
    frame_in,
    packed,
    packed_delivery,
    packed_notice,
    packed_overflow,
    packed_refusal,
    received,
    unpacked,
)
from slipbench.bench.bus.wire import Wire
from slipbench.bench.loop.realtime_process import realtime_process
from slipbench.protocol.errors import InputError

LIFETIME = 1.0  # s, after the last node has left
MOST_MEMBERS = 256  # connections; `select`, which waits for microseconds, takes descriptors to 1023
FULL = f"the bus is full: it has {MOST_MEMBERS} nodes"
BACKLOG = 1 << 16  # records that wait for a node that does not read; further ones are lost


def address(channel: str) -> bytes:
    """Abstract socket address of a channel of this user, of at most 108 bytes.

    Raises ValueError where the name of the channel is too long.
    """
    name = f"\0slipbench-bus/{os.getuid()}/".encode() + channel.encode()
    if len(name) > 108:
        raise ValueError(f"the name of the channel is longer than {108 - len(name)} bytes")
    return name


def user_of_peer(link: socket.socket) -> int:
    """User id of the process at the other end of a connected local socket (SO_PEERCRED)."""
    _, user, _ = struct.unpack("3i", link.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, 12))
    return int(user)


class Member:
    """Connection of a node: its socket, its node after its HELLO, the records that wait for it."""

    def __init__(self, link: socket.socket) -> None:
        """Use the non-blocking socket `link`."""
        self.link = link
        self.node: Node | None = None
        self.waiting: deque[bytes] = deque()
        self.lost = 0

    def send(self, record: bytes) -> None:
        """Send a record now, or when the socket has room for it."""
        if len(self.waiting) >= BACKLOG:
            self.lost += 1
            return
        self.waiting.append(record)
        self.flush()

    def flush(self) -> None:
        """Send the waiting records, as far as the socket has room."""
        try:
            while self.waiting:
                self.link.send(self.waiting[0])
                self.waiting.popleft()
        except BlockingIOError:
            return
        except OSError:
            self.waiting.clear()  # the node has left; the next read shows it
        if self.lost:
            self.lost = 0
            state = self.node.state if self.node else Confinement.ACTIVE
            self.send(packed_overflow(state, time.monotonic_ns()))


class Broker:
    """The wire and the connections of its nodes."""

    def __init__(self, listener: socket.socket) -> None:
        """Accept connections at `listener`."""
        self._listener = listener
        self._members: dict[int, Member] = {}
        self._of_node: dict[Node, Member] = {}
        self._wire: Wire | None = None
        self._spare = os.open(os.devnull, os.O_RDONLY)

    def serve(self) -> None:
        """Run the bus until every node has left."""
        alone_since = time.monotonic_ns()
        while True:
            readable, writable = self._wait()
            for number in writable:
                if number in self._members:
                    self._members[number].flush()
            for number in readable:
                if number == self._listener.fileno():
                    self._accept()
                elif number in self._members:  # it may have been closed meanwhile, to make room
                    self._read(number)
            self._advance()
            now = time.monotonic_ns()
            if self._members:
                alone_since = now
            elif now - alone_since > LIFETIME * 1e9:
                return

    def _wait(self) -> tuple[list[int], list[int]]:
        """Sockets to read and to write, after waiting for one of them or for an event on the wire."""
        due = None if self._wire is None else self._wire.next_ns
        pause = None if self._members else LIFETIME
        if due is not None:
            pause = max(0.0, (due - time.monotonic_ns()) * 1e-9)
        readers = [self._listener.fileno(), *self._members]
        writers = [number for number, member in self._members.items() if member.waiting]
        readable, writable, _ = select.select(readers, writers, [], pause)
        return readable, writable

    def _read(self, number: int) -> None:
        """Read and handle all records that one member has sent."""
        member = self._members[number]
        try:
            while packet := received(member.link):
                self._handle(member, unpacked(packet))
        except BlockingIOError:
            return
        except (OSError, ValueError, TypeError, InputError) as cause:
            member.send(packed(Kind.REFUSED, str(cause).encode()))
        self._remove(number, member)

    def _accept(self) -> None:
        """Accept a connection of this user; where there is no room, close the oldest idle one.

        A connection is idle until its HELLO.
        """
        try:
            link, _ = self._listener.accept()
        except BlockingIOError:
            return  # it was closed meanwhile
        except OSError:  # no descriptor is left
            if not self._close_idle():
                self._reject_connection()
            return
        if user_of_peer(link) != os.getuid():
            link.close()
            return
        link.setblocking(False)
        if len(self._members) >= MOST_MEMBERS and not self._close_idle():
            Member(link).send(packed(Kind.REFUSED, FULL.encode()))
            link.close()
            return
        self._members[link.fileno()] = Member(link)

    def _close_idle(self) -> bool:
        """Close the oldest connection without a HELLO; False where there is none."""
        idle = next((pair for pair in self._members.items() if pair[1].node is None), None)
        if idle is not None:
            self._remove(*idle)
        return idle is not None

    def _reject_connection(self) -> None:
        """Accept and close a connection with the spare descriptor; it would wait for ever otherwise."""
        os.close(self._spare)
        try:
            self._listener.accept()[0].close()
        except OSError:
            pass  # it was closed meanwhile
        finally:
            self._spare = os.open(os.devnull, os.O_RDONLY)

    def _remove(self, number: int, member: Member) -> None:
        del self._members[number]
        if member.node is not None and self._wire is not None:
            del self._of_node[member.node]
            self._wire.detach(member.node)
        member.link.close()

    def _handle(self, member: Member, record: Record) -> None:
        """Act on a record. Raises ValueError, TypeError or InputError for an invalid one."""
        if record.kind is Kind.HELLO:
            self._join(member, Hello.read(record.content))
            return
        if member.node is None or self._wire is None:
            raise ValueError("the first record must be a HELLO")
        now = min(max(record.time_ns, self._wire.now_ns), time.monotonic_ns())
        if record.kind is Kind.FRAME:
            if not self._wire.offer(frame_in(record), member.node, now):
                member.send(packed_refusal(member.node.state, now))
        elif record.kind is Kind.RESTART:
            self._wire.restart(member.node, now)
        elif record.kind is Kind.FAULTS:
            self._wire.set_faults(read_plan(record.content.decode()), now)

    def _join(self, member: Member, hello: Hello) -> None:
        """Attach a member to the wire; the first member creates the wire."""
        rates = BitRates(hello.bitrate, hello.data_bitrate)
        if self._wire is None or not self._of_node:
            self._wire = Wire(rates, start_ns=time.monotonic_ns())
        elif self._wire.rates != rates:
            there = self._wire.rates
            raise ValueError(
                f"the bus runs at {there.nominal} and {there.data} bit/s, "
                f"not at {rates.nominal} and {rates.data}"
            )
        self._advance()
        queue = MostUrgent() if hello.urgent_first else InOrder()
        member.node = self._wire.attach(
            hello.name, queue, hello.fd, hello.restart_after, hello.room
        )
        self._of_node[member.node] = member
        member.send(packed(Kind.WELCOME, time_ns=self._wire.now_ns))

    def _advance(self) -> None:
        """Advance the wire to the present, and send each member its events."""
        wire = self._wire
        if wire is None:
            return
        for event in wire.advance(max(time.monotonic_ns(), wire.now_ns)):
            member = self._of_node.get(event.node)
            if member is None:
                continue
            if isinstance(event, Delivery):
                member.send(packed_delivery(event, wire.busy_ns))
            else:
                member.send(packed_notice(event))


def main(channel: str) -> None:
    """Serve a channel from a process in the background; returns when nodes can connect."""
    listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    try:
        listener.bind(address(channel))
    except OSError:
        return  # another broker was faster, and serves the channel
    listener.listen(64)
    listener.setblocking(False)
    if os.fork():
        return
    os.setsid()
    null = os.open(os.devnull, os.O_RDWR)
    for number in range(3):
        os.dup2(null, number)
    with realtime_process():
        Broker(listener).serve()


if __name__ == "__main__":
    main(sys.argv[1])
