"""python-can interface "slipbench": a node of a virtual bus that several processes share."""

import os
import select
import socket
import subprocess
import sys
import threading
import time
from collections import deque
from pathlib import Path

import can
from can.typechecking import CanFilters

from slipbench.bench.bus.broker import address, user_of_peer
from slipbench.bench.bus.counters import Confinement
from slipbench.bench.bus.faults import FaultPlan
from slipbench.bench.bus.frame import Frame
from slipbench.bench.bus.messages import STATES, error_message, frame_of, message_of
from slipbench.bench.bus.node import ROOM
from slipbench.bench.bus.plan_text import plan_text
from slipbench.bench.bus.records import (
    OWN,
    Hello,
    Kind,
    Record,
    frame_in,
    packed,
    packed_frame,
    received,
    state_in,
    unpacked,
)

ROOT = Path(__file__).parents[3]  # the broker needs it in its import path
TIMEOUT = 5.0  # s, for a reply of the broker
POLL_PERIOD = 0.05  # s between two checks of the inbox: another thread may have filled it
RECORD = 1024  # bytes that the kernel counts for a record to the broker, 768 here
SEND_BUFFER_FORCE = 32  # SO_SNDBUFFORCE of <asm/socket.h>: above the limit, with the right to


class SlipbenchBus(can.BusABC):
    """Bus with the timing, the arbitration and the faults of a real bus, without hardware.

        can.Bus(interface="slipbench", channel="bike", bitrate=1_000_000)

    All nodes of one channel, of one user on one machine, share a wire. `bench/bus/wire.py` states
    what it models and what it does not. In addition, in real time: deliveries are late where the
    machine is (their time stamps are not); a frame that reaches the broker after the wire has
    advanced takes part in the next arbitration; all nodes must request the same bit rates. The wire
    of a channel exists as long as a node is on it.
    """

    def __init__(
        self,
        channel: str = "slipbench",
        can_filters: CanFilters | None = None,
        receive_own_messages: bool = False,
        fd: bool = False,
        bitrate: int = 1_000_000,
        data_bitrate: int = 2_000_000,
        name: str = "",
        restart_after: float | None = None,
        queue_length: int = ROOM,
        urgent_first: bool = False,
        single_handle: bool = True,
    ) -> None:
        """Join the bus `channel`; the first node starts it.

        bitrate, data_bitrate  bit/s; the latter for CAN FD frames that switch their rate
        name                   name of this node in a fault plan
        restart_after          s after bus-off at which recovery begins; None: only at `restart`
        queue_length           frames, capacity of the transmit queue; Linux has 10 on hardware
        urgent_first           sends its most urgent frame first, as a controller with mailboxes
                               does, instead of sending in order
        single_handle          has no effect; python-can's tests pass it to every interface

        Raises CanInitializationError where the bus cannot be joined.
        """
        self.channel_info = f"slipbench bus '{channel}'"
        self._channel, self._fd, self._receive_own_messages = str(channel), fd, receive_own_messages
        self._can_protocol = can.CanProtocol.CAN_FD if fd else can.CanProtocol.CAN_20
        self._inbox: deque[can.Message] = deque()
        self._reading = threading.Lock()
        self._unsent = 0  # frames given to the bus that it has not sent yet
        self._confinement = Confinement.ACTIVE
        self._origin = time.time_ns() - time.monotonic_ns()
        self._room = queue_length
        hello = Hello(
            name or f"{os.getpid()}",
            bitrate,
            data_bitrate,
            fd,
            restart_after,
            queue_length,
            urgent_first,
        )
        self._link = _join(self._channel, hello)
        _make_room(self._link, queue_length * RECORD)
        self._since = self._until = (time.monotonic_ns(), 0)  # time and busy time, ns
        super().__init__(channel=channel, can_filters=can_filters)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Queue a frame; waits up to `timeout` s where the queue is full, by default not at all.

        Raises CanOperationError where the queue stays full, or the node is bus-off.
        """
        frame = self._sendable(msg)
        deadline = time.monotonic() + (timeout or 0.0)
        if self._unsent >= self._room:
            self._receive_waiting()
        while self._unsent >= self._room and time.monotonic() < deadline:
            self._wait(min(POLL_PERIOD, max(0.0, deadline - time.monotonic())))
            self._receive_waiting()
        if self._confinement is Confinement.OFF:
            raise can.CanOperationError("bus off: too many errors")
        if self._unsent >= self._room:
            raise can.CanOperationError("Transmit buffer full")
        self._send_record(packed_frame(frame, time.monotonic_ns()), deadline)
        self._unsent += 1

    @property
    def state(self) -> can.BusState:
        """State of the controller: ACTIVE, PASSIVE (error-passive) or ERROR (bus-off)."""
        self._receive_waiting()
        return STATES[self._confinement]

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        raise NotImplementedError("the state of a controller follows from its error counters")

    def restart(self) -> None:
        """Begin recovery from bus-off: it ends after 128 times 11 recessive bits."""
        self._send_record(packed(Kind.RESTART, time_ns=time.monotonic_ns()))

    def inject(self, plan: FaultPlan) -> None:
        """Apply this fault plan to the whole bus from now on, instead of any other."""
        self._send_record(packed(Kind.FAULTS, plan_text(plan).encode(), time.monotonic_ns()))

    def load(self) -> float:
        """Bus load (0..1): fraction of time in which the wire was busy, from joining to the last frame."""
        self._receive_waiting()
        (begin, busy_before), (end, busy) = self._since, self._until
        return (busy - busy_before) / (end - begin) if end > begin else 0.0

    def fileno(self) -> int:
        """File descriptor for `select`; `recv(0)` may also have frames that were read from it before."""
        return self._link.fileno()

    def shutdown(self) -> None:
        """Leave the bus; queued frames are still sent."""
        super().shutdown()
        self._link.close()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            self._receive_waiting()
            try:
                return self._inbox.popleft(), False
            except IndexError:
                pass
            remaining = POLL_PERIOD if deadline is None else deadline - time.monotonic()
            if remaining <= 0:
                return None, False
            self._wait(min(remaining, POLL_PERIOD))

    def _wait(self, seconds: float) -> None:
        try:
            select.select([self._link], [], [], seconds)
        except (OSError, ValueError) as cause:
            raise can.CanOperationError(f"the bus is closed: {cause}") from cause

    def _receive_waiting(self) -> None:
        """Read and handle all records that the broker has sent."""
        with self._reading:
            while True:
                try:
                    packet = received(self._link)
                except BlockingIOError:
                    return
                except OSError as cause:
                    raise can.CanOperationError(f"the bus is closed: {cause}") from cause
                if not packet:
                    raise can.CanOperationError("the broker of the bus has ended")
                self._handle(unpacked(packet))

    def _handle(self, record: Record) -> None:
        stamp = (record.time_ns + self._origin) * 1e-9
        if record.kind is Kind.FRAME:
            own = bool(record.flags & OWN)
            self._unsent -= own
            if record.busy_ns and self._since[1] == 0:
                self._since = (record.time_ns, record.busy_ns)
            self._until = (record.time_ns, record.busy_ns)
            if not own or self._receive_own_messages:
                message = message_of(frame_in(record), stamp, own, self._channel)
                self._inbox.append(message)
        elif record.kind is Kind.ERROR:
            self._unsent -= record.busy_ns
            self._confinement = state_in(record)
            message = error_message(record.number, record.content, stamp, self._channel)
            self._inbox.append(message)
        elif record.kind is Kind.REFUSED:
            raise can.CanOperationError(f"rejected by the bus: {record.content.decode()}")

    def _sendable(self, message: can.Message) -> Frame:
        if message.is_error_frame:
            raise can.CanOperationError(
                "only a controller itself sends error frames; inject a fault plan instead"
            )
        if message.is_fd and not self._fd:
            raise can.CanOperationError("the bus was opened for classic CAN; open it with fd=True")
        return frame_of(message)

    def _send_record(self, record: bytes, deadline: float = 0.0) -> None:
        """Send a record to the broker; where its socket is full, wait until `deadline` (s).

        Raises CanOperationError where the socket stays full or is closed.
        """
        while True:
            try:
                self._link.send(record)
            except BlockingIOError as cause:
                remaining = deadline - time.monotonic()
                if remaining <= 0:
                    raise can.CanOperationError("Transmit buffer full") from cause
                select.select([], [self._link], [], remaining)
            except OSError as cause:
                raise can.CanOperationError(f"the bus is closed: {cause}") from cause
            else:
                return


def _join(channel: str, hello: Hello) -> socket.socket:
    """Connection to the broker of a channel after HELLO and WELCOME; starts a broker if needed.

    Raises CanInitializationError where the bus cannot be joined.
    """
    try:
        link = _connected(channel)
        link.send(packed(Kind.HELLO, hello.text()))
        reply = unpacked(received(link))
    except (OSError, ValueError, subprocess.SubprocessError) as cause:
        raise can.CanInitializationError(f"slipbench bus '{channel}': {cause}") from cause
    if reply.kind is not Kind.WELCOME:
        link.close()
        raise can.CanInitializationError(f"slipbench bus '{channel}': {reply.content.decode()}")
    link.setblocking(False)
    return link


def _make_room(link: socket.socket, size: int) -> None:
    """Set the send buffer to `size` bytes, or to as many as the system allows."""
    try:
        link.setsockopt(socket.SOL_SOCKET, SEND_BUFFER_FORCE, size)
    except OSError:
        link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, size)


def _connected(channel: str) -> socket.socket:
    deadline = time.monotonic() + TIMEOUT
    while True:
        link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        link.settimeout(TIMEOUT)
        try:
            link.connect(address(channel))
        except ConnectionRefusedError:
            link.close()
            if time.monotonic() > deadline:
                raise
            _start_broker(channel)
        else:
            break
    if (user := user_of_peer(link)) != os.getuid():
        link.close()
        raise PermissionError(
            f"user {user} has taken its address, but a broker of user {os.getuid()} is expected; "
            "choose another channel"
        )
    return link


def _start_broker(channel: str) -> None:
    """Start a broker; returns when nodes can connect to it."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    subprocess.run(
        [sys.executable, "-m", "slipbench.bench.bus.broker", channel],
        check=True,
        timeout=TIMEOUT,
        env={**os.environ, "PYTHONPATH": path},
        start_new_session=True,  # Ctrl-C must not end the broker
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
