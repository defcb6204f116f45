"""The wire of a CAN bus and the controllers on it, as a model: times and frames in, events out.

No clock, no I/O and no chance of its own: `advance(t)` gives everything that happens until `t`, and
the same calls give the same events. It imitates, after ISO 11898-1:

- arbitration by identifier, a frame that has begun never preempted;
- the time of every frame, its stuff bits exact, classic and FD, with a nominal and a data rate;
- acknowledgement: a frame that no other node hears is an error, and is sent again;
- error frames, at the bit where the error is met, and the repetition that follows;
- error counters, error-passive with its suspended transmission, bus-off, and recovery after 128
  times 11 recessive bits;
- two senders of one identifier: equal frames merge, others collide where they first differ.

It does not imitate:

- single bits: sampling, phase errors, edges, the part of a bit at which FD switches its rate;
- an error that only some of the nodes see, so no overload frames and no receiver's +8; flags are
  superposed to 12 bits, the longest; the place of a collision is counted without stuff bits;
- classic controllers that destroy CAN FD frames (they are merely not given any), nodes of unequal
  bit rates, listen-only nodes, CAN XL;
- cables: opens, shorts, missing termination. `Disturbed` and `Lost` stand for what they do.
"""

import heapq
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from bench.bus.counters import Confinement, Counters
from bench.bus.faults import NO_FAULTS, FaultPlan, Faults, Passage
from bench.bus.frame import END_OF_FRAME, INTERMISSION, BitRates, Frame
from bench.bus.queues import InOrder, Queue

FLAG = 12 + 8  # bits of an error frame: superposed flags, delimiter
SUSPENDED = 8  # bits that a passive node waits after a frame of its own
RECESSIVE = 11  # bits in a row, of which a node off the bus must see as many sequences as
SEQUENCES = 128
ROOM = 1000  # frames that wait in a node unless it says otherwise


class Cause(Enum):
    """What a node is told beside frames."""

    BIT = "a bit of the frame was destroyed"
    COLLISION = "another node sent another frame with this identifier"
    UNACKNOWLEDGED = "no other node heard the frame"
    STATE = "the error counters fell"
    RESTARTED = "the node is on the bus again"


class Node:
    """A controller: its counters, and the frames that wait in it. Made by `Wire.attach`."""

    def __init__(
        self,
        name: str,
        queue: Queue,
        room: int,
        fd: bool,
        restart_after: float | None,
        since_ns: int,
    ) -> None:
        """Come onto the bus at `since_ns`; see `Wire.attach`."""
        self.name, self.queue, self.room = name, queue, room
        self.fd, self.since_ns = fd, since_ns
        self.restart_after = restart_after
        self.counters, self.state = Counters(), Confinement.ACTIVE
        self.leaving = False
        self.ready_ns = since_ns  # suspended until then
        self.recovers_from: int | None = None  # ns; None: stays off the bus
        self.sequences = 0  # of 11 recessive bits, seen since

    @property
    def off(self) -> bool:
        """Tell whether the node has taken itself off the bus."""
        return self.state is Confinement.OFF


class Delivery(NamedTuple):
    """A frame at a node; `own`: the sender learns that its frame was sent."""

    time_ns: int
    node: Node
    frame: Frame
    own: bool


class Notice(NamedTuple):
    """An error that a node saw, or a change of its state; `dropped` frames of its own are gone."""

    time_ns: int
    node: Node
    cause: Cause
    counters: Counters
    sending: bool
    dropped: int = 0


Event = Delivery | Notice


@dataclass(frozen=True, slots=True)
class _Attempt:
    """A frame on the wire; `ends` and `free` in ns, at its last bit and after its intermission."""

    number: int
    begin: int
    ends: int
    free: int
    senders: tuple[Node, ...]
    frame: Frame
    error: Cause | None
    failed: tuple[Node, ...] = ()  # senders that met the error; the others get through


class Wire:
    """A bus and its nodes."""

    def __init__(self, rates: BitRates, faults: FaultPlan = NO_FAULTS, start_ns: int = 0) -> None:
        """Be idle since `start_ns`, which is also when the plan of faults begins."""
        self.rates = rates
        self.now_ns = self._free = self._recessive_from = start_ns
        self._nodes: list[Node] = []
        self._attempt: _Attempt | None = None
        self._recovering: list[Node] = []
        self._leaving = False
        self._number = 0
        self._late: list[tuple[int, int, Delivery]] = []  # by time
        self._overtaken: list[tuple[int, Delivery]] = []  # until when each waits
        self._order = 0
        self._busy = 0
        self.follow(faults, start_ns)

    def follow(self, faults: FaultPlan, begin_ns: int) -> None:
        """Follow this plan of faults from `begin_ns` on."""
        self._faults, self._faults_begin = Faults(faults), begin_ns

    def attach(
        self,
        name: str,
        queue: Queue | None = None,
        fd: bool = True,
        restart_after: float | None = None,
        room: int = ROOM,
    ) -> Node:
        """Put one more node on the bus; it sends in order unless `queue` says otherwise.

        `room` frames may wait in it. A node that went off the bus stays off, or begins to recover
        `restart_after` s later.
        """
        queue = InOrder() if queue is None else queue
        node = Node(name, queue, room, fd, restart_after, self.now_ns)
        self._nodes.append(node)
        return node

    def detach(self, node: Node) -> None:
        """Take a node off; what it was given to send is still sent, as long as anybody listens."""
        node.leaving = self._leaving = True
        self._forget_the_gone()

    def offer(self, frame: Frame, node: Node, time_ns: int) -> bool:
        """Give a node a frame to send; False where its queue is full or it is off the bus."""
        if node.off or len(node.queue) >= node.room:
            return False
        node.queue.push(time_ns, frame)
        return True

    def restart(self, node: Node, time_ns: int) -> None:
        """Let a node that is off the bus begin to recover."""
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
        """Tell when something will happen if nobody offers a frame; None: nothing will."""
        times = [time_ns for time_ns, _, _ in self._late[:1]]
        times += [time_ns for time_ns, _ in self._overtaken]
        if not self._unheard():
            begin = self._attempt.ends if self._attempt else self._next_begin()
            times += [] if begin is None else [begin]
        times += [self._recovers(node) for node in self._recovering]
        return min(times, default=None)

    def advance(self, time_ns: int) -> list[Event]:
        """Give all that happens until `time_ns`, in order; a frame may then be half sent.

        A frame offered at `time_ns` itself still contends with those that wait for that moment.
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
            if self._late or self._overtaken:
                self._deliver_late(attempt.ends, events)
            self._end(attempt, events)
        if self._late or self._overtaken:
            self._deliver_late(time_ns, events)
        self.now_ns = time_ns
        self._forget_the_gone()
        return events

    # Beginning

    def _next_begin(self) -> int | None:
        """Tell when the next frame begins, ns; None where no node has one."""
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

    def _begin(self, begin: int, until: int) -> _Attempt:
        """Let the nodes that are ready contend at `begin`, and see what becomes of the winner."""
        self._count_recessive(begin)
        ready = [
            (node.queue.first(begin), node)
            for node in self._nodes
            if node.queue.ready_ns is not None
            and node.queue.ready_ns <= begin
            and node.ready_ns <= begin
        ]
        self._number += 1
        if len(ready) > 1:
            lowest = min(frame.priority for frame, _ in ready)
            ready = [(frame, node) for frame, node in ready if frame.priority == lowest]
            if len(ready) > 1:
                return self._collide(begin, ready)
        frame, sender = ready[0]
        if not any(self._hears(node, begin) for node in self._nodes if node is not sender):
            return self._unacknowledged(begin, until, frame, sender)
        if self._faults:
            part = self._faults.disturbed(self._passage(begin, frame, sender.name, ""))
            if part is not None:
                return self._destroyed(begin, frame, (sender,), part)
        return self._whole(begin, frame, (sender,))

    def _hears(self, node: Node, begin: int) -> bool:
        return node.since_ns <= begin and node.state is not Confinement.OFF

    def _whole(self, begin: int, frame: Frame, senders: tuple[Node, ...]) -> _Attempt:
        free = begin + round(self.rates.duration(frame))
        ends = free - round(INTERMISSION * self.rates.bit)
        return _Attempt(self._number, begin, ends, free, senders, frame, None)

    def _failing(
        self, begin: int, after: float, frame: Frame, senders: tuple[Node, ...], cause: Cause
    ) -> _Attempt:
        """An attempt that ends by an error frame, which begins `after` ns into it."""
        ends = begin + round(after + FLAG * self.rates.bit)
        free = ends + round(INTERMISSION * self.rates.bit)
        return _Attempt(self._number, begin, ends, free, senders, frame, cause, senders)

    def _destroyed(
        self, begin: int, frame: Frame, senders: tuple[Node, ...], part: float
    ) -> _Attempt:
        bits = self.rates.bit
        after = bits + part * (self.rates.duration(frame) - (INTERMISSION + 1) * bits)
        return self._failing(begin, after, frame, senders, Cause.BIT)

    def _unacknowledged(self, begin: int, until: int, frame: Frame, sender: Node) -> _Attempt:
        """Repeat in vain; a passive node's counters no longer move, so all but the last is skipped.
        """  # fmt: skip
        after = self.rates.duration(frame) - (INTERMISSION + END_OF_FRAME + 1) * self.rates.bit
        once = self._failing(begin, after, frame, (sender,), Cause.UNACKNOWLEDGED)
        if sender.state is not Confinement.PASSIVE:
            return once
        cycle = once.free - begin + round(SUSPENDED * self.rates.bit)
        skipped = max(0, (until - begin) // cycle - 1)
        self._busy += skipped * (once.free - begin)
        begin += skipped * cycle
        return self._failing(begin, after, frame, (sender,), Cause.UNACKNOWLEDGED)

    def _collide(self, begin: int, winners: list[tuple[Frame, Node]]) -> _Attempt:
        """Let two frames with one identifier meet: the first bit that differs decides.

        An active node that loses destroys the other's frame too; a passive one cannot.
        """
        dominant = min((frame for frame, _ in winners), key=lambda frame: frame.after_arbitration)
        through = tuple(node for frame, node in winners if frame == dominant)
        losers = tuple(node for frame, node in winners if frame != dominant)
        if not losers:
            return self._whole(begin, dominant, through)
        other = next(frame for frame, _ in winners if frame != dominant)
        if all(node.state is Confinement.PASSIVE for node in losers):
            whole = self._whole(begin, dominant, through)
            return _Attempt(
                whole.number, begin, whole.ends, whole.free, through + losers, dominant,
                Cause.COLLISION, losers,
            )  # fmt: skip
        after = _common_bits(dominant, other) * self.rates.bit
        return self._failing(begin, after, dominant, through + losers, Cause.COLLISION)

    # Ending

    def _end(self, attempt: _Attempt, events: list[Event]) -> None:
        """Let every node draw its conclusions from what was on the wire."""
        self._free = attempt.free
        self._recessive_from = attempt.free - round(RECESSIVE * self.rates.bit)
        self._busy += attempt.free - attempt.begin
        through = [node for node in attempt.senders if node not in attempt.failed]
        if through:
            self._succeed(attempt, through, events)
        if attempt.failed:
            self._fail(attempt, bool(through), events)
        for node in attempt.senders:
            if node.state is Confinement.PASSIVE:
                node.ready_ns = attempt.free + round(SUSPENDED * self.rates.bit)

    def _succeed(self, attempt: _Attempt, through: list[Node], events: list[Event]) -> None:
        frame, ends = attempt.frame, attempt.ends
        if self._faults:
            self._faults.remember(self._passage(ends, frame, through[0].name, ""))
        for node in self._nodes:
            if node in attempt.failed or not self._hears(node, attempt.begin):
                continue
            own = node in through
            if own:
                node.queue.pop()
                events.append(Delivery(ends, node, frame, own))
            elif not node.leaving and (node.fd or not frame.fd):
                self._deliver(attempt, node, through[0], events)
            if any(node.counters):
                now = node.counters.sent() if own else node.counters.heard()
                self._set(node, now, Cause.STATE, own, ends, events)

    def _deliver(self, attempt: _Attempt, node: Node, sender: Node, events: list[Event]) -> None:
        """Give a receiver the frame, or what the faults leave of it."""
        if not self._faults:
            events.append(Delivery(attempt.ends, node, attempt.frame, False))
            return
        passage = self._passage(attempt.ends, attempt.frame, sender.name, node.name)
        for copy in self._faults.copies(passage._replace(number=attempt.number)):
            time_ns = attempt.ends + round(copy.delay * 1e9)
            delivery = Delivery(time_ns, node, attempt.frame._replace(data=copy.data), False)
            if copy.overtaken:
                self._overtaken.append((time_ns + round(copy.overtaken * 1e9), delivery))
            elif copy.delay:
                self._order += 1
                heapq.heappush(self._late, (time_ns, self._order, delivery))
            else:
                self._arrive(delivery, events)

    def _arrive(self, delivery: Delivery, events: list[Event]) -> None:
        """Deliver, and after it whatever waited to be overtaken by it."""
        events.append(delivery)
        if not self._overtaken:
            return
        passed = [held for _, held in self._overtaken if held.node is delivery.node]
        self._overtaken = [each for each in self._overtaken if each[1].node is not delivery.node]
        events.extend(held._replace(time_ns=delivery.time_ns) for held in passed)

    def _deliver_late(self, time_ns: int, events: list[Event]) -> None:
        while self._late and self._late[0][0] <= time_ns:
            self._arrive(heapq.heappop(self._late)[2], events)
        if self._overtaken:
            over = [each for each in self._overtaken if each[0] <= time_ns]
            self._overtaken = [each for each in self._overtaken if each[0] > time_ns]
            events.extend(held._replace(time_ns=until) for until, held in over)

    def _fail(self, attempt: _Attempt, others_through: bool, events: list[Event]) -> None:
        """Count the error at everybody who met it."""
        assert attempt.error is not None
        unheard = attempt.error is Cause.UNACKNOWLEDGED
        for node in list(self._nodes):
            if node in attempt.failed:
                counters = node.counters.send_failed(unheard)
                self._set(node, counters, attempt.error, True, attempt.ends, events)
            elif not others_through and self._hears(node, attempt.begin):
                counters = node.counters.hearing_failed()
                self._set(node, counters, attempt.error, False, attempt.ends, events)

    def _set(
        self, node: Node, counters: Counters, cause: Cause, sending: bool, time_ns: int,
        events: list[Event],
    ) -> None:  # fmt: skip
        """Give a node its new counters, and tell it of errors and of changes of its state."""
        before, node.counters, node.state = node.state, counters, counters.state
        dropped = 0
        if node.off:
            dropped = node.queue.clear()
            node.recovers_from = None
            if node.restart_after is not None:
                self.restart(node, time_ns + round(node.restart_after * 1e9))
        if cause is not Cause.STATE or node.state is not before:
            events.append(Notice(time_ns, node, cause, counters, sending, dropped))

    # Recovery

    def _recovers(self, node: Node) -> int:
        """Tell when a node is on the bus again if the wire stays idle, ns."""
        missing = (SEQUENCES - node.sequences) * RECESSIVE * self.rates.bit
        return max(self._recessive_from, node.recovers_from or 0) + round(missing)

    def _recover(self, time_ns: int, events: list[Event]) -> None:
        for node in tuple(self._recovering):
            back = self._recovers(node)
            if back <= time_ns:
                self._recovering.remove(node)
                node.recovers_from = None
                node.ready_ns = back
                self._set(node, Counters(), Cause.RESTARTED, False, back, events)

    def _count_recessive(self, begin: int) -> None:
        """Count the sequences of 11 recessive bits that a frame at `begin` brings to an end."""
        for node in self._recovering:
            quiet = begin - max(self._recessive_from, node.recovers_from or 0)
            node.sequences += max(0, int(quiet / (RECESSIVE * self.rates.bit)))

    # Nodes

    def _unheard(self) -> bool:
        """Tell whether a passive node sends in vain, to which nothing new can happen."""
        live = [node for node in self._nodes if not node.off]
        return len(live) == 1 and live[0].state is Confinement.PASSIVE

    def _forget_the_gone(self) -> None:
        if self._leaving and self._attempt is None:
            listening = any(not node.leaving for node in self._nodes)
            self._nodes = [
                node for node in self._nodes if not node.leaving or (node.queue and listening)
            ]
            self._leaving = any(node.leaving for node in self._nodes)

    def _passage(self, time_ns: int, frame: Frame, sender: str, receiver: str) -> Passage:
        since = (time_ns - self._faults_begin) * 1e-9
        return Passage(frame, self._number, since, sender, receiver)


def _common_bits(one: Frame, other: Frame) -> int:
    """Count the bits that two frames with one identifier share, stuff bits left out."""
    head = 39 if one.extended else 19
    if one.fd != other.fd or one.after_arbitration[1] != other.after_arbitration[1]:
        return head
    differing = int.from_bytes(one.data, "big") ^ int.from_bytes(other.data, "big")
    return head + 8 * len(one.data) - differing.bit_length() + 1
