"""Buses of each kind that the bench is used with."""

import contextlib
import itertools
import os
import time
import uuid
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import can

from slipbench.bench.bus.simulated_bus import SimulatedBus

PATIENCE = 5.0  # s; a frame that has not come by then is lost
VCAN = os.environ.get("SLIPBENCH_VCAN", "")  # set where a real vcan exists: tests/socketcan
_names = itertools.count()


@dataclass(frozen=True)
class Wire:
    """`node(receive_own_messages)` attaches a node; `settle()` lets frames that were sent arrive."""

    node: Callable[[bool], can.BusABC]
    settle: Callable[[], None]
    knows_own: bool = True  # is_rx is False for the node's own frames alone


@contextlib.contextmanager
def virtual() -> Iterator[Wire]:
    """python-can's bus within one process."""
    name = f"wire {next(_names)}"
    with _nodes(interface="virtual", channel=name, protocol=can.CanProtocol.CAN_FD) as node:
        yield Wire(node, lambda: None)


@contextlib.contextmanager
def socketcan() -> Iterator[Wire]:
    """A virtual CAN interface of a Linux kernel, through real sockets.

    Linux marks every frame that was sent on the same machine, and python-can's `is_rx` is False for
    all of them: two programs on one vcan cannot tell their own frames from each other's by it.
    """
    with _nodes(interface="socketcan", channel=VCAN, fd=True) as node:
        yield Wire(node, lambda: None, knows_own=False)


@contextlib.contextmanager
def simulated() -> Iterator[Wire]:
    """The bench's own bus, on the simulated clock."""
    bus = SimulatedBus(1_000_000)
    names = (f"node {number}" for number in itertools.count())
    nodes: list[can.BusABC] = []

    def node(receive_own_messages: bool = False) -> can.BusABC:
        nodes.append(bus.node(next(names), receive_own_messages))
        return nodes[-1]

    yield Wire(node, lambda: bus.advance_to(bus.now_ns + 10_000_000_000))
    for each in nodes:
        each.shutdown()


@contextlib.contextmanager
def slipbench() -> Iterator[Wire]:
    """The bench's own bus, in real time, through a broker in a process of its own."""
    with _nodes(interface="slipbench", channel=f"wire {uuid.uuid4()}", fd=True) as node:
        yield Wire(node, lambda: None)


@contextlib.contextmanager
def _nodes(**bus: Any) -> Iterator[Callable[[bool], can.BusABC]]:
    with contextlib.ExitStack() as open_nodes:

        def node(receive_own_messages: bool = False) -> can.BusABC:
            return open_nodes.enter_context(
                can.Bus(receive_own_messages=receive_own_messages, **bus)
            )

        yield node


WIRES = (
    {"socketcan": socketcan} if VCAN else {f.__name__: f for f in (virtual, simulated, slipbench)}
)


def send(node: can.BusABC, message: can.Message) -> int:
    """Send; where the socket's buffer is full, try again. Returns how often it was refused."""
    deadline = time.monotonic() + PATIENCE
    for refusals in itertools.count():
        try:
            node.send(message)
        except can.CanOperationError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.001)
        else:
            return refusals
    raise AssertionError("unreachable")


def carry(
    wire: Wire, sender: can.BusABC, listener: can.BusABC, messages: Sequence[can.Message]
) -> list[can.Message]:
    """Send, and receive as a gateway does, before a socket's buffer (some 280 frames) is full."""
    heard: list[can.Message] = []
    for first in range(0, len(messages), 100):
        some = messages[first : first + 100]
        for message in some:
            send(sender, message)
        wire.settle()
        heard += receive(listener, len(some))
    return heard


def receive(node: can.BusABC, count: int) -> list[can.Message]:
    """Receive `count` frames, or as many as come."""
    messages: list[can.Message] = []
    while len(messages) < count:
        message = node.recv(PATIENCE)
        if message is None:
            break
        messages.append(message)
    return messages
