"""The bus under a test and its clock: simulated, or any interface of python-can in real time."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from itertools import count
from math import inf
from typing import Protocol

import can

from slipbench.bench.bus.faults import Disturbed, Fault, FaultPlan, Where
from slipbench.bench.bus.opening import BusAddress, open_bus, stamps_wall_time
from slipbench.bench.bus.python_can import SlipbenchBus
from slipbench.bench.bus.simulated_bus import SimulatedBus
from slipbench.bench.gateway.stamps import SteadyStamps, as_stamped
from slipbench.bench.loop.clock import SECOND, MonotonicClock
from slipbench.bench.loop.realtime_process import one_processor, realtime_process
from slipbench.bench.testing.faulty_node import FaultyNode
from slipbench.protocol.errors import InputError

BITRATE = 1_000_000  # bit/s, of the simulated bus
START = SECOND  # ns; simulated recordings begin a second into the epoch, as those of a trial
SPIN = 20_000  # ns: short, because the devices under test need the processor as well

# A received message and its time in ns on the clock of the line.
Listener = Callable[[can.Message, int], None]
Done = Callable[[], bool]


class Line(Protocol):
    """A bus and its clock. Times are ns on that clock."""

    real_time: bool

    def now_ns(self) -> int:
        """Time of the clock, ns."""

    def node(self, name: str, receive_own_messages: bool = False) -> can.BusABC:
        """New node on the bus."""

    def advance(self, time_ns: int, listener: Listener, each_frame: bool, done: Done) -> None:
        """Let time pass until `time_ns`, or until a frame makes `done` true.

        listener    receives every frame
        each_frame  at the time of the frame, and not only at `time_ns`
        """

    def set_faults(self, faults: Sequence[Fault], origin_ns: int, seed: int) -> None:
        """Apply these faults instead of all others; their times count from `origin_ns`.

        Raises InputError where a fault could have no effect on this line.
        """

    def close(self) -> None:
        """Leave the bus."""


class SimulatedLine:
    """Bus on the simulated clock: time passes only in `advance`."""

    real_time = False

    def __init__(self, bitrate: int = BITRATE) -> None:
        """Start with an idle bus (bit/s)."""
        self._wire = SimulatedBus(bitrate, start_ns=START)
        self._wire.advance_to(START)
        self._nodes: list[can.BusABC] = []
        self._names: set[str] = set()
        self._observer = self.node("observer")

    def now_ns(self) -> int:
        """Time of the clock, ns."""
        return self._wire.now_ns

    def node(self, name: str, receive_own_messages: bool = False) -> can.BusABC:
        """New node on the bus."""
        node = self._wire.node(name, receive_own_messages)
        self._names.add(name)
        self._nodes.append(node)
        return node

    def advance(self, time_ns: int, listener: Listener, each_frame: bool, done: Done) -> None:
        """Simulate the bus until `time_ns`; see `Line.advance`."""
        while each_frame and (event := self._wire.wire.next_ns) is not None and event < time_ns:
            self._wire.advance_to(max(event, self.now_ns() + 1))
            self._listen(listener)
            if done():
                return
        self._wire.advance_to(time_ns)
        self._listen(listener)

    def _listen(self, listener: Listener) -> None:
        while (message := self._observer.recv(0)) is not None:
            listener(message, round(message.timestamp * SECOND))

    def set_faults(self, faults: Sequence[Fault], origin_ns: int, seed: int) -> None:
        """Apply these faults on the wire; see `Line.set_faults`. Raises InputError as it does."""
        for fault in faults:
            for name in sorted({*fault.where.senders, *fault.where.receivers} - self._names):
                raise InputError(
                    f"a fault names the node {name!r}, which is not on the bus",
                    expected=f"one of {', '.join(sorted(self._names))}",
                    found=name,
                    remedy="use the fixture of that node first, or correct the name",
                )
        self._wire.wire.set_faults(FaultPlan(tuple(faults), seed), origin_ns)

    def close(self) -> None:
        """Leave the bus."""
        for node in self._nodes:
            node.shutdown()


class LiveLine:
    """Bus in real time, on any interface of python-can.

    On the interface "slipbench" faults act on the wire. On all others they act on the frames that
    nodes of this process send, before they are sent: the frames of a real device cannot be changed.
    """

    real_time = True

    def __init__(self, address: BusAddress) -> None:
        """Join the bus, as a real-time process as far as this process has the rights.

        Raises InputError with the remedy where the bus cannot be opened.
        """
        self._address, self._clock = address, MonotonicClock(SPIN)
        self._nodes: list[can.BusABC] = []
        self._faulty: list[FaultyNode] = []
        self._numbers = count()
        self._faults: tuple[Sequence[Fault], int, int] = ((), 0, 0)
        self._heard: set[int] = set()  # identifiers of the frames on the bus
        self._rights = ExitStack()
        self._observer = self._open()
        wall = stamps_wall_time(self._observer)
        self._stamp = SteadyStamps(self._clock) if wall else as_stamped
        self._trusted = wall or isinstance(self._observer, SlipbenchBus)
        self._rights.enter_context(realtime_process(one_processor()))

    def now_ns(self) -> int:
        """Time of the clock, ns."""
        return self._clock.now_ns()

    def _open(self, receive_own_messages: bool = False) -> can.BusABC:
        bus = open_bus(self._address, receive_own_messages)
        self._nodes.append(bus)
        return bus

    def node(self, name: str, receive_own_messages: bool = False) -> can.BusABC:
        """New node on the bus."""
        bus = self._open(receive_own_messages)
        if isinstance(bus, SlipbenchBus):
            return bus
        self._faulty.append(FaultyNode(bus, name, self._clock.now_ns, self._numbers))
        self._faulty[-1].set_faults(*self._faults)
        return self._faulty[-1]

    def advance(self, time_ns: int, listener: Listener, each_frame: bool, done: Done) -> None:
        """Wait until `time_ns` and receive meanwhile; see `Line.advance`."""
        while True:
            for node in self._faulty:
                node.send_delayed()
            now = self._clock.now_ns()
            message = self._observer.recv(max(0.0, (time_ns - now - SPIN) / SECOND))
            if message is not None:
                self._heard.add(message.arbitration_id)
                stamped = self._stamp(message.timestamp) if self._trusted else None
                listener(message, self._clock.now_ns() if stamped is None else stamped)
                if done():
                    return
            elif now >= time_ns - SPIN:
                self._clock.sleep_until_ns(time_ns)
                return

    def set_faults(self, faults: Sequence[Fault], origin_ns: int, seed: int) -> None:
        """Apply these faults; see `Line.set_faults`. Raises InputError as it does."""
        check_names(faults, isinstance(self._observer, SlipbenchBus))
        if isinstance(self._observer, SlipbenchBus):
            elapsed = (self._clock.now_ns() - origin_ns) / SECOND
            shifted = tuple(_earlier(fault, elapsed) for fault in faults)
            self._observer.inject(FaultPlan(shifted, seed))
            return
        self._check_possible(faults)
        self._faults = (faults, origin_ns, seed)
        for node in self._faulty:
            node.set_faults(*self._faults)

    def _check_possible(self, faults: Sequence[Fault]) -> None:
        """Refuse faults that only a virtual bus can do."""
        if any(isinstance(fault, Disturbed) for fault in faults):
            raise InputError(
                "error frames cannot be made on this interface",
                found=self._address.interface,
                expected="the simulated clock, or --slipbench-interface slipbench",
                remedy="use another fault, or skip the test with @pytest.mark.skipif",
            )
        ours = {identifier for node in self._faulty for identifier in node.sent}
        targeted = {identifier for fault in faults for identifier in fault.where.identifiers}
        foreign = sorted((targeted & self._heard) - ours)
        if foreign:
            raise InputError(
                "frames of a real device cannot be changed on a real bus",
                expected="a message that this test, its vehicle, gateway or replay sends",
                found=", ".join(f"{identifier:#x}" for identifier in foreign),
                remedy="silence the device itself, or simulate it (--slipbench-device)",
            )

    def close(self) -> None:
        """Leave the bus; the process is an ordinary one again."""
        self._rights.close()
        for node in (*self._faulty, *self._nodes):
            node.shutdown()


def check_names(faults: Sequence[Fault], senders_too: bool) -> None:
    """Raises InputError where a fault names nodes, whose names a live bus does not know.

    senders_too  names of senders are unknown as well; else those of this process are known
    """
    for fault in faults:
        where = fault.where
        named = {*where.receivers, *(where.senders if senders_too else ())}
        if named:
            raise InputError(
                "a fault for single nodes needs the simulated clock",
                expected="a fault for all receivers",
                found=", ".join(sorted(named)),
                remedy="leave out to=, or run the test with --slipbench-clock simulated",
            )


def _earlier(fault: Fault, by: float) -> Fault:
    where = fault.where
    end = where.end if where.end == inf else max(0.0, where.end - by)
    moved = Where(
        max(0.0, where.begin - by), end, where.identifiers, where.senders, where.receivers
    )
    return replace(fault, where=moved)
