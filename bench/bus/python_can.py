"""The python-can interface "slipbench": a node of a virtual bus that other processes share."""

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

ROOT = Path(__file__).parents[3]  # what a broker must find on its path
PATIENCE = 5.0  # s for a broker to answer
GLANCE = 0.05  # s: how long one thread may miss what another has taken in
RECORD = 1024  # bytes that the kernel counts for a record under way to the broker, 768 here
SEND_BUFFER_FORCE = 32  # SO_SNDBUFFORCE of <asm/socket.h>: beyond the limit, for those who may


class SlipbenchBus(can.BusABC):
    """A bus with the timing, the arbitration and the faults of a real one, without hardware.

        can.Bus(interface="slipbench", channel="bike", bitrate=1_000_000)

    All that open one channel, of this user and this machine, share a wire. What the wire imitates,
    and what it does not, is told in `bench/bus/wire.py`. Beyond that, in real time: deliveries are
    as late as the machine is (their time stamps are not); a frame that reaches the broker after
    the wire has gone on contends with the next; all nodes must ask for the same bit rates. A
    channel's wire lives as long as anybody is on it.
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
        """Join the bus `channel`; the first to do so starts it.

        bitrate, data_bitrate  bit/s; the latter for CAN FD frames that switch their rate
        name                   what a plan of faults calls this node
        restart_after          s after which a node that went off the bus begins to recover; None:
                               it stays off until `restart`
        queue_length           frames that wait in this node; Linux has 10 on hardware
        urgent_first           it offers its most urgent frame, as a controller with mailboxes does,
                               instead of sending in order
        single_handle          means nothing here; python-can's tests pass it to every interface

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
        self._link = _joined(self._channel, hello)
        _make_room(self._link, queue_length * RECORD)
        self._since = self._until = (time.monotonic_ns(), 0)  # time and busy time, ns
        super().__init__(channel=channel, can_filters=can_filters)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Queue a frame; waits up to `timeout` s where the queue is full, by default not at all.

        Raises CanOperationError where it stays full, or the node is off the bus.
        """
        frame = self._sendable(msg)
        deadline = time.monotonic() + (timeout or 0.0)
        if self._unsent >= self._room:
            self._take_in()
        while self._unsent >= self._room and time.monotonic() < deadline:
            self._wait(min(GLANCE, max(0.0, deadline - time.monotonic())))
            self._take_in()
        if self._confinement is Confinement.OFF:
            raise can.CanOperationError("bus off: the node has left the bus after too many errors")
        if self._unsent >= self._room:
            raise can.CanOperationError("Transmit buffer full")
        self._tell(packed_frame(frame, time.monotonic_ns()), deadline)
        self._unsent += 1

    @property
    def state(self) -> can.BusState:
        """Tell the controller's state: ACTIVE, PASSIVE (error-passive) or ERROR (off the bus)."""
        self._take_in()
        return STATES[self._confinement]

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        raise NotImplementedError("a controller's state follows from its error counters")

    def restart(self) -> None:
        """Begin to recover, when off the bus: after 128 times 11 recessive bits it is back."""
        self._tell(packed(Kind.RESTART, time_ns=time.monotonic_ns()))

    def inject(self, plan: FaultPlan) -> None:
        """Let the whole bus follow this plan of faults from now on, instead of any other."""
        self._tell(packed(Kind.FAULTS, plan_text(plan).encode(), time.monotonic_ns()))

    def load(self) -> float:
        """Tell which part of the time (0..1) the wire was busy, from joining to the last frame."""
        self._take_in()
        (begin, busy_before), (end, busy) = self._since, self._until
        return (busy - busy_before) / (end - begin) if end > begin else 0.0

    def fileno(self) -> int:
        """Give what `select` waits on; what `recv(0)` still gives has been taken from it before."""
        return self._link.fileno()

    def shutdown(self) -> None:
        """Leave the bus; what was sent is still sent."""
        super().shutdown()
        self._link.close()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        deadline = None if timeout is None else time.monotonic() + timeout
        while True:
            self._take_in()
            try:
                return self._inbox.popleft(), False
            except IndexError:
                pass
            left = GLANCE if deadline is None else deadline - time.monotonic()
            if left <= 0:
                return None, False
            self._wait(min(left, GLANCE))

    def _wait(self, seconds: float) -> None:
        try:
            select.select([self._link], [], [], seconds)
        except (OSError, ValueError) as cause:
            raise can.CanOperationError(f"the bus is closed: {cause}") from cause

    def _take_in(self) -> None:
        """Read all that the broker has said."""
        with self._reading:
            while True:
                try:
                    packet = received(self._link)
                except BlockingIOError:
                    return
                except OSError as cause:
                    raise can.CanOperationError(f"the bus is closed: {cause}") from cause
                if not packet:
                    raise can.CanOperationError("the bus is gone: its broker has ended")
                self._understand(unpacked(packet))

    def _understand(self, record: Record) -> None:
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
            raise can.CanOperationError(f"the bus refused: {record.content.decode()}")

    def _sendable(self, message: can.Message) -> Frame:
        if message.is_error_frame:
            raise can.CanOperationError(
                "a controller sends error frames by itself; inject a plan of faults instead"
            )
        if message.is_fd and not self._fd:
            raise can.CanOperationError("the bus was opened for classic CAN; open it with fd=True")
        return frame_of(message)

    def _tell(self, record: bytes, deadline: float = 0.0) -> None:
        """Give a record to the broker; where it is far behind, wait for it until `deadline`, s."""
        while True:
            try:
                self._link.send(record)
            except BlockingIOError as cause:
                left = deadline - time.monotonic()
                if left <= 0:
                    raise can.CanOperationError("Transmit buffer full") from cause
                select.select([], [self._link], [], left)
            except OSError as cause:
                raise can.CanOperationError(f"the bus is closed: {cause}") from cause
            else:
                return


def _joined(channel: str, hello: Hello) -> socket.socket:
    """Connect to the channel's broker, which is started where there is none, and be let in."""
    try:
        link = _connected(channel)
        link.send(packed(Kind.HELLO, hello.text()))
        answer = unpacked(received(link))
    except (OSError, ValueError, subprocess.SubprocessError) as cause:
        raise can.CanInitializationError(f"slipbench bus '{channel}': {cause}") from cause
    if answer.kind is not Kind.WELCOME:
        link.close()
        raise can.CanInitializationError(f"slipbench bus '{channel}': {answer.content.decode()}")
    link.setblocking(False)
    return link


def _make_room(link: socket.socket, size: int) -> None:
    """Let `size` bytes wait for the broker, or as many as the system allows."""
    try:
        link.setsockopt(socket.SOL_SOCKET, SEND_BUFFER_FORCE, size)
    except OSError:
        link.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, size)


def _connected(channel: str) -> socket.socket:
    deadline = time.monotonic() + PATIENCE
    while True:
        link = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        link.settimeout(PATIENCE)
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
            f"its address is taken by user {user}, and a broker of user {os.getuid()} is expected; "
            "choose another channel"
        )
    return link


def _start_broker(channel: str) -> None:
    """Start a broker, which goes into the background once it can be connected to."""
    path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
    subprocess.run(
        [sys.executable, "-m", "slipbench.bench.bus.broker", channel],
        check=True,
        timeout=PATIENCE,
        env={**os.environ, "PYTHONPATH": path},
        start_new_session=True,  # Ctrl-C is for whoever opens the bus
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
