"""A node of a real bus whose own frames are lost, delayed or changed before they are sent."""

import heapq
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import can

from slipbench.bench.bus.faults import Fault, FaultPlan, Faults, Passage
from slipbench.bench.bus.messages import frame_of
from slipbench.bench.loop.clock import SECOND


class FaultyNode(can.BusABC):
    """Sends and receives through another bus; a fault plan acts on what it sends.

    The faults are those of `bench/bus/faults.py`. They act once for all receivers, since a real bus
    has only one frame for all of them. A reordered frame is sent when its time is over.
    """

    def __init__(
        self, bus: can.BusABC, name: str, now_ns: Callable[[], int], numbers: Iterator[int]
    ) -> None:
        """Use `bus` under `name`. numbers: of the frames of all nodes of the bus."""
        self._bus, self._name, self._now_ns, self._numbers = bus, name, now_ns, numbers
        self._faults, self._origin = Faults(FaultPlan()), 0
        self._delayed: list[tuple[int, int, can.Message]] = []  # due (ns), number, message
        self.sent: set[int] = set()  # identifiers
        self.channel_info = bus.channel_info
        super().__init__(channel=name)

    def set_faults(self, faults: Sequence[Fault], origin_ns: int, seed: int) -> None:
        """Apply these faults; their times count from `origin_ns`."""
        self._faults, self._origin = Faults(FaultPlan(tuple(faults), seed)), origin_ns

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send a message as changed by the faults."""
        self.sent.add(msg.arbitration_id)
        if not self._faults:
            self._bus.send(msg, timeout)
            return
        now, number = self._now_ns(), next(self._numbers)
        since = (now - self._origin) / SECOND
        passage = Passage(frame_of(msg), number, since, self._name, "")
        self._faults.remember(passage)
        for index, copy in enumerate(self._faults.copies(passage)):
            changed = _with_data(msg, copy.data)
            late = copy.delay + copy.overtaken
            if late:
                due = now + round(late * SECOND)
                heapq.heappush(self._delayed, (due, 8 * number + index, changed))
            else:
                self._bus.send(changed, timeout)

    def send_delayed(self) -> None:
        """Send the delayed messages that are due."""
        while self._delayed and self._delayed[0][0] <= self._now_ns():
            self._bus.send(heapq.heappop(self._delayed)[2])

    @property
    def state(self) -> can.BusState:
        """State of the controller, where the interface reports it."""
        return self._bus.state

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        self._bus.state = new_state

    def fileno(self) -> int:
        """File descriptor for `select`, where the interface has one."""
        return self._bus.fileno()

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        return self._bus.recv(timeout), False

    def _apply_filters(self, filters: Any) -> None:
        """Leave filtering to the base class."""


def _with_data(message: can.Message, data: bytes) -> can.Message:
    return can.Message(
        arbitration_id=message.arbitration_id,
        is_extended_id=message.is_extended_id,
        is_remote_frame=message.is_remote_frame,
        is_fd=message.is_fd,
        bitrate_switch=message.bitrate_switch,
        dlc=message.dlc if message.is_remote_frame else None,
        data=None if message.is_remote_frame else data,
    )
