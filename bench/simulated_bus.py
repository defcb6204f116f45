"""A CAN bus on the simulated clock: arbitration by identifier, and frames that take their time.

It imitates bit rate, arbitration and frame length with the stuff bits that each frame really has.
It does not imitate CAN FD, error frames, error counters, bus-off, or losses.
"""

import heapq
from collections import deque
from copy import copy
from typing import Any

import can

from protocol.frame_bits import classic_frame_bits


class SimulatedBus:
    """The wire; nodes are python-can buses, so that the gateway cannot tell the difference."""

    def __init__(self, bitrate: int) -> None:
        """Run at `bitrate` (bit/s)."""
        self._bit = 1e9 / bitrate
        self._nodes: list[SimulatedNode] = []
        self._waiting: list[tuple[int, int, can.Message, SimulatedNode]] = []  # by time sent
        self._contending: list[tuple[int, int, can.Message, SimulatedNode]] = []  # by identifier
        self._on_the_wire: tuple[int, can.Message, SimulatedNode] | None = None  # ends at, ns
        self._free = 0  # ns, when the wire is next idle
        self._sequence = 0
        self.now_ns = 0

    def node(self, name: str, hears_itself: bool = False) -> "SimulatedNode":
        """Attach one more node."""
        node = SimulatedNode(self, name, hears_itself)
        self._nodes.append(node)
        return node

    def offer(self, message: can.Message, node: "SimulatedNode") -> None:
        """Queue a frame that is ready to contend for the wire now."""
        self._sequence += 1
        entry = (self.now_ns, self._sequence, message, node)
        heapq.heappush(self._waiting, entry)

    def advance_to(self, time_ns: int) -> None:
        """Deliver every frame that ends by `time_ns`; one that has begun is not preempted."""
        while self._on_the_wire or self._waiting or self._contending:
            ends, message, sender = self._on_the_wire or self._arbitrate()
            self._on_the_wire = (ends, message, sender)
            if ends > time_ns:
                break
            self._on_the_wire = None
            self._free = ends
            self._deliver(message, sender, ends)
        self.now_ns = time_ns

    def _arbitrate(self) -> tuple[int, can.Message, "SimulatedNode"]:
        """Let the lowest identifier of those that are ready when the wire is idle win."""
        begins = self._free
        if not self._contending:
            begins = max(begins, self._waiting[0][0])
        self._join_contention(begins)
        _, _, message, sender = heapq.heappop(self._contending)
        return begins + round(_bits(message) * self._bit), message, sender

    def _join_contention(self, time_ns: int) -> None:
        while self._waiting and self._waiting[0][0] <= time_ns:
            _, sequence, message, node = heapq.heappop(self._waiting)
            priority = message.arbitration_id << (0 if message.is_extended_id else 18)
            heapq.heappush(self._contending, (priority, sequence, message, node))

    def _deliver(self, message: can.Message, sender: "SimulatedNode", time_ns: int) -> None:
        message.timestamp = time_ns * 1e-9
        message.is_rx = True
        for node in self._nodes:
            if node is not sender:
                node.inbox.append(message)
                message = _twin(message)  # each listener may do with its own what it likes
        if sender.hears_itself:
            message.is_rx = False
            sender.inbox.append(message)


class SimulatedNode(can.BusABC):
    """One node of the simulated bus."""

    def __init__(self, wire: SimulatedBus, name: str, hears_itself: bool) -> None:
        """Attach to `wire`."""
        self._wire, self.hears_itself = wire, hears_itself
        self.inbox: deque[can.Message] = deque()
        self.channel_info = f"simulated: {name}"
        super().__init__(channel=name)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Queue a frame for arbitration."""
        self._wire.offer(_twin(msg), self)  # who sent it may go on using it

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self.inbox:
            return None, False
        return self.inbox.popleft(), False

    def _apply_filters(self, filters: Any) -> None:
        """Leave filtering to the base class."""


def _bits(message: can.Message) -> int:
    return classic_frame_bits(message.arbitration_id, message.is_extended_id, message.data)


def _twin(message: can.Message) -> can.Message:
    """Copy a frame, its payload included, which python-can's own shallow copy shares."""
    twin = copy(message)
    twin.data = bytearray(message.data)
    return twin
