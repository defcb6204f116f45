"""A CAN bus on the simulated clock: the model of the wire under python-can's buses.

What it imitates, and what it does not, stands in `bench/bus/wire.py`.
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
    """The wire; nodes are python-can buses, so that the gateway cannot tell the difference."""

    def __init__(
        self,
        bitrate: int,
        data_bitrate: int = 2_000_000,
        faults: FaultPlan = NO_FAULTS,
        start_ns: int = 0,
    ) -> None:
        """Run at these rates (bit/s); the plan of faults begins at `start_ns`."""
        self.wire = Wire(BitRates(bitrate, data_bitrate), faults, start_ns)
        self._nodes: dict[Node, SimulatedNode] = {}

    @property
    def now_ns(self) -> int:
        """Tell the time to which the bus has been advanced."""
        return self.wire.now_ns

    def node(
        self, name: str, receive_own_messages: bool = False, restart_after: float | None = None
    ) -> "SimulatedNode":
        """Attach one more node, which offers its most urgent frame first.

        `restart_after` s after it went off the bus it begins to recover; None: never.
        """
        node = self.wire.attach(name, MostUrgent(), restart_after=restart_after)
        self._nodes[node] = SimulatedNode(self, node, receive_own_messages)
        return self._nodes[node]

    def detach(self, node: Node) -> None:
        """Take a node off the bus."""
        self.wire.detach(node)
        self._nodes.pop(node, None)

    def advance_to(self, time_ns: int) -> None:
        """Deliver every frame that ends by `time_ns`; one that has begun is not preempted."""
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
        """Speak for `node` of `bus`."""
        self._wire, self._node, self.receive_own_messages = bus, node, receive_own_messages
        self.inbox: deque[can.Message] = deque()
        self.channel_info = f"simulated: {node.name}"
        super().__init__(channel=node.name)

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Queue a frame for arbitration."""
        if not self._wire.wire.offer(frame_of(msg), self._node, self._wire.now_ns):
            raise can.CanOperationError("bus off" if self._node.off else "Transmit buffer full")

    @property
    def state(self) -> can.BusState:
        """Tell the controller's state: ACTIVE, PASSIVE (error-passive) or ERROR (off the bus)."""
        return STATES[self._node.state]

    @state.setter
    def state(self, new_state: can.BusState) -> None:
        raise NotImplementedError("a controller's state follows from its error counters")

    def shutdown(self) -> None:
        """Leave the bus."""
        super().shutdown()
        self._wire.detach(self._node)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if not self.inbox:
            return None, False
        return self.inbox.popleft(), False

    def _apply_filters(self, filters: Any) -> None:
        """Leave filtering to the base class."""
