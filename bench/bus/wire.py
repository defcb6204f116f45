"""Model of the wire of a CAN bus and its controllers: frames and times in, events out.

It has no clock, no I/O and no random state: `advance(t)` returns all events until `t`, and the same
calls return the same events. It models, after ISO 11898-1:

- arbitration by identifier, a frame that has begun never preempted;
- the time of every frame, its stuff bits exact, classic and FD, with a nominal and a data rate;
- acknowledgement: a frame that no other node acknowledges is an error, and is sent again;
- error frames, at the bit where the error occurs, and the repetition that follows;
- error counters, error-passive with its suspended transmission, bus-off, and recovery after 128
  times 11 recessive bits;
- two senders of one identifier: equal frames merge, others collide at the first different bit.

It does not model:

- single bits: sampling, phase errors, edges, the part of a bit at which FD switches its rate;
- an error that only some of the nodes detect, hence no overload frames and no +8 of a receiver; error
  flags are superposed to 12 bits, the longest; the bit of a collision is counted without stuff bits;
- classic controllers that destroy CAN FD frames (they receive none instead), nodes with different
  bit rates, listen-only nodes, CAN XL;
- cables: opens, shorts, missing termination. `Disturbed` and `Lost` model their effects.
"""

from slipbench.bench.bus.arrivals import Arrivals
from slipbench.bench.bus.attempt import (
    SUSPENDED,
    Attempt,
    collision,
    destroyed,
    successful,
    unacknowledged,
)
from slipbench.bench.bus.counters import Confinement, Counters
from slipbench.bench.bus.events import Cause, Delivery, Event, Notice
from slipbench.bench.bus.faults import NO_FAULTS, FaultPlan
from slipbench.bench.bus.frame import BitRates, Frame
from slipbench.bench.bus.node import ROOM, Node
from slipbench.bench.bus.queues import InOrder, Queue

RECESSIVE = 11  # recessive bits of a sequence
NO_ERRORS = Counters()
SEQUENCES = 128  # such sequences after which a node recovers from bus-off


class Wire:
    """Wire of a bus, and its nodes."""

    def __init__(self, rates: BitRates, faults: FaultPlan = NO_FAULTS, start_ns: int = 0) -> None:
        """Start idle at `start_ns`, at which the fault plan begins as well."""
        self.rates = rates
        self.now_ns = self._free = self._recessive_from = start_ns
        self._nodes: list[Node] = []
        self._attempt: Attempt | None = None
        self._recovering: list[Node] = []
        self._leaving = False
        self._number = 0
        self._busy = 0
        self._arrivals = Arrivals(faults, start_ns)
        self._recessive = round(RECESSIVE * rates.bit)  # ns, of one sequence

    def set_faults(self, faults: FaultPlan, begin_ns: int) -> None:
        """Apply this fault plan from `begin_ns` on."""
        self._arrivals.set_faults(faults, begin_ns)

    def attach(
        self,
        name: str,
        queue: Queue | None = None,
        fd: bool = True,
        restart_after: float | None = None,
        room: int = ROOM,
    ) -> Node:
        """New node on the bus.

        queue          its transmit queue; None: first in, first out
        restart_after  s after bus-off at which recovery begins; None: it stays bus-off
        room           frames, capacity of the queue
        """
        queue = InOrder() if queue is None else queue
        node = Node(name, queue, room, fd, restart_after, self.now_ns)
        self._nodes.append(node)
        return node

    def detach(self, node: Node) -> None:
        """Remove a node; its queued frames are still sent while another node receives them."""
        node.leaving = self._leaving = True
        self._remove_detached()

    def offer(self, frame: Frame, node: Node, time_ns: int) -> bool:
        """Whether the node queued the frame; False where its queue is full or it is bus-off."""
        if node.off or len(node.queue) >= node.room:
            return False
        node.queue.push(time_ns, frame)
        return True

    def restart(self, node: Node, time_ns: int) -> None:
        """Begin the recovery of a node that is bus-off."""
        if node.off and node.recovers_from is None:
            node.recovers_from, node.sequences = time_ns, 0
            self._recovering.append(node)

    @property
    def busy_ns(self) -> int:
        """Time for which the wire has been busy since the start, up to now."""
        running = self.now_ns - self._attempt.begin if self._attempt else 0
        return self._busy + running - max(0, self._free - self.now_ns)

    @property
    def next_ns(self) -> int | None:
        """Time of the next event if no node queues a frame, ns; None: there is none."""
        times = [self._arrivals.next_ns, *map(self._recovery_time, self._recovering)]
        if not self._sends_unacknowledged():
            times.append(self._attempt.ends if self._attempt else self._next_begin())
        return min((time_ns for time_ns in times if time_ns is not None), default=None)

    def advance(self, time_ns: int) -> list[Event]:
        """All events until `time_ns`, in order; a frame may be half sent then.

        A frame that is queued at `time_ns` itself still takes part in the arbitration at that time.
        """
        events: list[Event] = []
        while True:
            if self._attempt is None:
                begin = self._next_begin()
                if self._recovering:
                    self._recover(time_ns if begin is None else min(begin, time_ns), events)
                if begin is None or begin >= time_ns:
                    break
                self._attempt = self._begin(begin, time_ns)
            attempt = self._attempt
            if attempt.ends > time_ns:
                break
            self._attempt = None
            self._arrivals.deliver_due(attempt.ends, events)
            self._end(attempt, events)
        self._arrivals.deliver_due(time_ns, events)
        self.now_ns = time_ns
        self._remove_detached()
        return events

    # Begin of a frame

    def _next_begin(self) -> int | None:
        """Time at which the next frame begins, ns; None where no node has one."""
        earliest = None
        for node in self._nodes:
            ready = node.queue.ready_ns
            if ready is None:
                continue
            if node.ready_ns > ready:
                ready = node.ready_ns
            if earliest is None or ready < earliest:
                earliest = ready
        return None if earliest is None else max(earliest, self._free)

    def _begin(self, begin: int, until: int) -> Attempt:
        """Attempt that begins at `begin`, after arbitration between the nodes that are ready."""
        self._count_recessive(begin)
        ready = []
        for node in self._nodes:
            since = node.queue.ready_ns
            if since is not None and since <= begin and node.ready_ns <= begin:
                ready.append((node.queue.first(begin), node))
        self._number += 1
        if len(ready) > 1:
            lowest = min(frame.priority for frame, _ in ready)
            ready = [(frame, node) for frame, node in ready if frame.priority == lowest]
            if len(ready) > 1:
                return collision(self.rates, begin, ready)
        frame, sender = ready[0]
        if not any(node.receives(begin) for node in self._nodes if node is not sender):
            attempt, busy = unacknowledged(self.rates, begin, until, frame, sender)
            self._busy += busy
            return attempt
        part = self._arrivals.disturbed(begin, self._number, frame, sender.name)
        if part is not None:
            return destroyed(self.rates, begin, frame, (sender,), part)
        return successful(self.rates, begin, frame, (sender,))

    # End of a frame

    def _end(self, attempt: Attempt, events: list[Event]) -> None:
        """Deliver the frame or the error of an attempt to every node."""
        self._free = attempt.free
        self._recessive_from = attempt.free - self._recessive
        self._busy += attempt.free - attempt.begin
        through = attempt.senders
        if attempt.failed:
            through = tuple(node for node in attempt.senders if node not in attempt.failed)
        if through:
            self._succeed(attempt, through, events)
        if attempt.failed:
            self._fail(attempt, bool(through), events)
        for node in attempt.senders:
            if node.state is Confinement.PASSIVE:
                node.ready_ns = attempt.free + round(SUSPENDED * self.rates.bit)

    def _succeed(self, attempt: Attempt, through: tuple[Node, ...], events: list[Event]) -> None:
        frame, ends, sender = attempt.frame, attempt.ends, through[0].name
        self._arrivals.remember(ends, self._number, frame, sender)
        for node in self._nodes:
            if node in attempt.failed or not node.receives(attempt.begin):
                continue
            own = node in through
            if own:
                node.queue.pop()
                events.append(Delivery(ends, node, frame, own))
            elif not node.leaving and (node.fd or not frame.fd):
                self._arrivals.deliver(ends, self._number, frame, sender, node, events)
            if node.counters != NO_ERRORS:
                now = node.counters.sent() if own else node.counters.received()
                self._set(node, now, Cause.STATE, own, ends, events)

    def _fail(self, attempt: Attempt, others_through: bool, events: list[Event]) -> None:
        """Count the error at every node that detected it."""
        assert attempt.error is not None
        unheard = attempt.error is Cause.UNACKNOWLEDGED
        for node in list(self._nodes):
            if node in attempt.failed:
                counters = node.counters.send_failed(unheard)
                self._set(node, counters, attempt.error, True, attempt.ends, events)
            elif not others_through and node.receives(attempt.begin):
                counters = node.counters.receive_failed()
                self._set(node, counters, attempt.error, False, attempt.ends, events)

    def _set(
        self,
        node: Node,
        counters: Counters,
        cause: Cause,
        sending: bool,
        time_ns: int,
        events: list[Event],
    ) -> None:
        """Set the counters of a node, and notify it of errors and of changes of its state."""
        before, node.counters, node.state = node.state, counters, counters.state
        dropped = 0
        if node.off:
            dropped = node.queue.clear()
            node.recovers_from = None
            if node.restart_after is not None:
                self.restart(node, time_ns + round(node.restart_after * 1e9))
        if cause is not Cause.STATE or node.state is not before:
            events.append(Notice(time_ns, node, cause, counters, sending, dropped))

    # Recovery from bus-off

    def _recovery_time(self, node: Node) -> int:
        """Time at which the recovery of a node ends if the wire stays idle, ns."""
        missing = (SEQUENCES - node.sequences) * RECESSIVE * self.rates.bit
        return max(self._recessive_from, node.recovers_from or 0) + round(missing)

    def _recover(self, time_ns: int, events: list[Event]) -> None:
        for node in tuple(self._recovering):
            back = self._recovery_time(node)
            if back <= time_ns:
                self._recovering.remove(node)
                node.recovers_from = None
                node.ready_ns = back
                self._set(node, Counters(), Cause.RESTARTED, False, back, events)

    def _count_recessive(self, begin: int) -> None:
        """Count the sequences of 11 recessive bits before a frame that begins at `begin`."""
        for node in self._recovering:
            quiet = begin - max(self._recessive_from, node.recovers_from or 0)
            node.sequences += max(0, int(quiet / (RECESSIVE * self.rates.bit)))

    # Nodes

    def _sends_unacknowledged(self) -> bool:
        """Whether one error-passive node sends without acknowledgement: its state is constant."""
        live = [node for node in self._nodes if not node.off]
        return len(live) == 1 and live[0].state is Confinement.PASSIVE

    def _remove_detached(self) -> None:
        if self._leaving and self._attempt is None:
            listening = any(not node.leaving for node in self._nodes)
            self._nodes = [
                node for node in self._nodes if not node.leaving or (node.queue and listening)
            ]
            self._leaving = any(node.leaving for node in self._nodes)
