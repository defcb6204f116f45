"""Faults of simulated nodes: a fault plan applied to what the virtual motorcycle sends and receives.

The plan is that of the bus model (`bench/bus/faults.py`), and it acts on any interface. Senders are the
nodes by name, or "motorcycle" for all of them. A frame that the motorcycle sends is changed for all
receivers on the bus; it counts as received by "gateway". A frame that it receives counts as sent by
"gateway", or by the real device's node, and as received by "motorcycle".
"""

from dataclasses import replace

from slipbench.bench.bus.arrivals import Arrivals
from slipbench.bench.bus.events import Delivery, Event
from slipbench.bench.bus.faults import Disturbed, Fault, FaultPlan
from slipbench.bench.bus.frame import Frame
from slipbench.bench.bus.node import Node
from slipbench.bench.bus.queues import MostUrgent
from slipbench.bench.vehicle.nodes import MESSAGES_OF
from slipbench.protocol.errors import InputError

GATEWAY, MOTORCYCLE = "gateway", "motorcycle"


class _Direction:
    """Frames to one receiver, and those that the faults hold back."""

    def __init__(self, plan: FaultPlan, receiver: str) -> None:
        self._arrivals = Arrivals(plan, 0)
        self._node = Node(receiver, MostUrgent(), 0, False, None, 0)
        self._events: list[Event] = []
        self._number = 0

    def put(self, frame: Frame, sender: str, time_ns: int) -> None:
        """Take a frame of `sender`."""
        self._number += 1
        self._arrivals.remember(time_ns, self._number, frame, sender)
        self._arrivals.deliver(time_ns, self._number, frame, sender, self._node, self._events)

    def due(self, time_ns: int) -> list[Frame]:
        """Remove and return the frames that are due."""
        self._arrivals.deliver_due(time_ns, self._events)
        frames = [event.frame for event in self._events if isinstance(event, Delivery)]
        self._events.clear()
        return frames


class NodeFaults:
    """A fault plan and the frames that it holds back. Times in s since the simulation began."""

    def __init__(self, plan: FaultPlan) -> None:
        """Apply `plan`. Raises InputError for a fault or a name that no node of this bus has."""
        checked = replace(plan, faults=tuple(_of_nodes(fault) for fault in plan.faults))
        self._out, self._in = _Direction(checked, GATEWAY), _Direction(checked, MOTORCYCLE)

    def send(self, frame: Frame, sender: str, now: float) -> None:
        """Take a frame that the node `sender` sends at `now`."""
        self._out.put(frame, sender, _ns(now))

    def receive(self, frame: Frame, sender: str, now: float) -> None:
        """Take a frame that arrives from `sender` at `now`."""
        self._in.put(frame, sender, _ns(now))

    def leaving(self, now: float) -> list[Frame]:
        """Remove and return the frames that leave by `now`."""
        return self._out.due(_ns(now))

    def arriving(self, now: float) -> list[Frame]:
        """Remove and return the frames that arrive by `now`."""
        return self._in.due(_ns(now))


def _ns(time: float) -> int:
    return round(time * 1e9)


def _of_nodes(fault: Fault) -> Fault:
    """The fault with "motorcycle" as a sender replaced by all of its nodes."""
    if isinstance(fault, Disturbed):
        raise InputError(
            "the fault plan destroys frames on the wire, which a node cannot do",
            where="disturbed",
            remedy="use lost or corrupted; on the bus model, inject the plan into the bus itself",
        )
    _check_names("senders", set(fault.where.senders), (MOTORCYCLE, GATEWAY, *MESSAGES_OF))
    _check_names("receivers", set(fault.where.receivers), (GATEWAY, MOTORCYCLE))
    if MOTORCYCLE not in fault.where.senders:
        return fault
    senders = frozenset(fault.where.senders) | frozenset(MESSAGES_OF)
    return replace(fault, where=replace(fault.where, senders=senders))


def _check_names(key: str, names: set[str], known: tuple[str, ...]) -> None:
    if unknown := sorted(names - set(known)):
        raise InputError(
            "the fault plan names a node that is not on this bus",
            where=key,
            expected=", ".join(known),
            found=", ".join(unknown),
        )
