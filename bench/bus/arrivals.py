"""Reception of frames: content and arrival time after the faults of a fault plan."""

import heapq

from slipbench.bench.bus.events import Delivery, Event
from slipbench.bench.bus.faults import FaultPlan, Faults, Passage
from slipbench.bench.bus.frame import Frame
from slipbench.bench.bus.node import Node


class Arrivals:
    """Applies a fault plan to received frames; holds delayed and reordered frames."""

    def __init__(self, plan: FaultPlan, begin_ns: int) -> None:
        """Apply `plan` from `begin_ns` on."""
        self.set_faults(plan, begin_ns)
        self._late: list[tuple[int, int, Delivery]] = []  # heap of delayed frames, by arrival time
        self._overtaken: list[tuple[int, Delivery]] = []  # latest arrival (ns) and frame
        self._order = 0

    def set_faults(self, plan: FaultPlan, begin_ns: int) -> None:
        """Apply another plan from `begin_ns` on; frames that are held already stay held."""
        self._faults, self._faulty, self._begin = Faults(plan), bool(plan.faults), begin_ns

    @property
    def next_ns(self) -> int | None:
        """Arrival time of the next held frame, ns; None where there is none."""
        times = [self._late[0][0]] if self._late else []
        return min([*times, *(time_ns for time_ns, _ in self._overtaken)], default=None)

    def disturbed(self, time_ns: int, number: int, frame: Frame, sender: str) -> float | None:
        """Fraction (0..1) of its length after which attempt `number` is destroyed, or None."""
        if not self._faulty:
            return None
        return self._faults.disturbed(self._passage(time_ns, number, frame, sender, ""))

    def remember(self, time_ns: int, number: int, frame: Frame, sender: str) -> None:
        """Store the payload of a frame, for faults that repeat it."""
        if self._faulty:
            self._faults.remember(self._passage(time_ns, number, frame, sender, ""))

    def deliver(
        self, time_ns: int, number: int, frame: Frame, sender: str, node: Node, events: list[Event]
    ) -> None:
        """Deliver the frame to a receiver, as changed by the faults."""
        if not self._faulty:
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

    def deliver_due(self, time_ns: int, events: list[Event]) -> None:
        """Deliver every held frame that is due by `time_ns`."""
        while self._late and self._late[0][0] <= time_ns:
            self._arrive(heapq.heappop(self._late)[2], events)
        if self._overtaken:
            over = [each for each in self._overtaken if each[0] <= time_ns]
            self._overtaken = [each for each in self._overtaken if each[0] > time_ns]
            events.extend(held._replace(time_ns=until) for until, held in over)

    def _arrive(self, delivery: Delivery, events: list[Event]) -> None:
        """Deliver a frame, and after it the reordered frames that waited for it."""
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
