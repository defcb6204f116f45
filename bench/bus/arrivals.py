"""Between the wire and a receiver: what planned faults leave of a frame, and when it arrives."""

import heapq

from slipbench.bench.bus.events import Delivery, Event
from slipbench.bench.bus.faults import FaultPlan, Faults, Passage
from slipbench.bench.bus.frame import Frame
from slipbench.bench.bus.node import Node


class Arrivals:
    """Follows a plan of faults, and keeps what is late or waits to be overtaken."""

    def __init__(self, plan: FaultPlan, begin_ns: int) -> None:
        """Follow `plan` from `begin_ns` on."""
        self._faults, self._begin = Faults(plan), begin_ns
        self._late: list[tuple[int, int, Delivery]] = []  # by time
        self._overtaken: list[tuple[int, Delivery]] = []  # until when each waits
        self._order = 0

    def follow(self, plan: FaultPlan, begin_ns: int) -> None:
        """Follow another plan from `begin_ns` on; what is under way stays so."""
        self._faults, self._begin = Faults(plan), begin_ns

    @property
    def next_ns(self) -> int | None:
        """Tell when the next late frame arrives; None where there is none."""
        times = [self._late[0][0]] if self._late else []
        return min([*times, *(time_ns for time_ns, _ in self._overtaken)], default=None)

    def disturbed(self, time_ns: int, number: int, frame: Frame, sender: str) -> float | None:
        """Tell after which part (0..1) of its length attempt `number` is destroyed, if it is."""
        if not self._faults:
            return None
        return self._faults.disturbed(self._passage(time_ns, number, frame, sender, ""))

    def remember(self, time_ns: int, number: int, frame: Frame, sender: str) -> None:
        """Keep what was carried, for whoever freezes the next."""
        if self._faults:
            self._faults.remember(self._passage(time_ns, number, frame, sender, ""))

    def deliver(
        self, time_ns: int, number: int, frame: Frame, sender: str, node: Node, events: list[Event]
    ) -> None:
        """Give a receiver the frame, or what the faults leave of it."""
        if not self._faults:
            self._arrive(Delivery(time_ns, node, frame, False), events)
            return
        for copy in self._faults.copies(self._passage(time_ns, number, frame, sender, node.name)):
            due = time_ns + round(copy.delay * 1e9)
            delivery = Delivery(due, node, frame._replace(data=copy.data), False)
            if copy.overtaken:
                self._overtaken.append((due + round(copy.overtaken * 1e9), delivery))
            elif copy.delay:
                self._order += 1
                heapq.heappush(self._late, (due, self._order, delivery))
            else:
                self._arrive(delivery, events)

    def come(self, time_ns: int, events: list[Event]) -> None:
        """Let everything arrive that is due by `time_ns`."""
        while self._late and self._late[0][0] <= time_ns:
            self._arrive(heapq.heappop(self._late)[2], events)
        if self._overtaken:
            over = [each for each in self._overtaken if each[0] <= time_ns]
            self._overtaken = [each for each in self._overtaken if each[0] > time_ns]
            events.extend(held._replace(time_ns=until) for until, held in over)

    def _arrive(self, delivery: Delivery, events: list[Event]) -> None:
        """Deliver, and after it whatever waited to be overtaken by it."""
        events.append(delivery)
        if not self._overtaken:
            return
        passed = [held for _, held in self._overtaken if held.node is delivery.node]
        self._overtaken = [each for each in self._overtaken if each[1].node is not delivery.node]
        events.extend(held._replace(time_ns=delivery.time_ns) for held in passed)

    def _passage(
        self, time_ns: int, number: int, frame: Frame, sender: str, receiver: str
    ) -> Passage:
        return Passage(frame, number, (time_ns - self._begin) * 1e-9, sender, receiver)
