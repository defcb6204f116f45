"""CAN bus on the simulated clock: python-can buses as nodes of the model of the wire.

`bench/bus/wire.py` states what it models and what it does not.
"""

from collections import deque
from typing import Any

import can

from slipbench.bench.bus.events import Delivery
from slipbench.bench.bus.faults import NO_FAULTS, FaultPlan
from slipbench.bench.bus.frame import BitRates
from slipbench.bench.bus.messages import STATES, error_of, frame_of, message_of
from slipbench.bench.bus.node import Node
from slipbench.bench.bus.queues import MostUrgent
from slipbench.bench.bus.wire import Wire


class SimulatedBus:
    """The wire; its nodes are python-can buses, as on hardware."""

    def __init__(
        self,
        bitrate: int,
        data_bitrate: int = 2_000_000,
        faults: FaultPlan = NO_FAULTS,
        start_ns: int = 0,
    ) -> None:
        """Run at these bit rates (bit/s); the fault plan begins at `start_ns`."""
        self.wire = Wire(BitRates(bitrate, data_bitrate), faults, start_ns)
        self._nodes: dict[Node, SimulatedNode] = {}

    @property
    def now_ns(self) -> int:
        """Time to which the bus has been advanced, ns."""
        return self.wire.now_ns

    def node(
        self, name: str, receive_own_messages: bool = False, restart_after: float | None = None
    ) -> "SimulatedNode":
        """New node, which sends its most urgent frame first.

        restart_after: s after bus-off at which recovery begins; None: never.
        """
        node = self.wire.attach(name, MostUrgent(), restart_after=restart_after)
        self._nodes[node] = SimulatedNode(self, node, receive_own_messages)
        return self._nodes[node]

    def detach(self, node: Node) -> None:
        """Remove a node from the bus."""
        self.wire.detach(node)
        self._nodes.pop(node, None)

    def advance_to(self, time_ns: int) -> None:
        """Deliver every frame that ends by `time_ns`; a frame that has begun is not preempted."""
        for event in self.wire.advance(time_ns):
            listener = self._nodes.get(event.node)
            if listener is None:
                continue
            if not isinstance(event, Delivery):
                listener.inbox.append(error_of(event, event.time_ns * 1e-9, None))
            elif not event.own or listener.receive_own_messages:
                message = message_of(event.frame, event.time_ns * 1e-9, event.own, None)
                listener.inbox.append(message)


class SimulatedNode(can.BusABC):
    """One node of the simulated bus."""

    def __init__(self, bus: SimulatedBus, node: Node, receive_own_messages: bool) -> None:
        """Send and receive as `node` of `bus`."""
        self._wire, self._node, self.receive_own_messages = bus, node, receive_own_messages
        self.inbox: deque[can.Message] = deque()
        self.channel_info = f"simulated: {node.name}"
        super().__init__(channel=node.name)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Queue a frame. Raises CanOperationError where the queue is full or the node is bus-off."""
        if not self._wire.wire.offer(frame_of(msg), self._node, self._wire.now_ns):
            raise can.CanOperationError("bus off" if self._node.off else "Transmit buffer full")

    @property
    def state(self) -> can.BusState:
        """State of the controller: ACTIVE, PASSIVE (error-passive) or ERROR (bus-off)."""
        return STATES[self._node.state]

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        raise NotImplementedError("the state of a controller follows from its error counters")

    def shutdown(self) -> None:
        """Leave the bus."""
        super().shutdown()
        self._wire.detach(self._node)

    def recv(self, timeout: float | None = None) -> can.Message | None:
        """Next frame that has arrived; None where there is none: no time passes while one waits."""
        while self.inbox:
            message = self.inbox.popleft()
            if self._filters is None or self._matches_filters(message):
                return message
        return None

    def _apply_filters(self, filters: Any) -> None:
        """Leave filtering to the base class."""
