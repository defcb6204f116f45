"""Node: a CAN controller on the wire, its error counters and its transmit queue."""

from slipbench.bench.bus.counters import Confinement, Counters
from slipbench.bench.bus.queues import Queue

ROOM = 1000  # frames, default capacity of a transmit queue


class Node:
    """One CAN controller. `Wire.attach` creates it; only its wire changes it."""

    def __init__(
        self,
        name: str,
        queue: Queue,
        room: int,
        fd: bool,
        restart_after: float | None,
        since_ns: int,
    ) -> None:
        """Join the bus at `since_ns`; see `Wire.attach`."""
        self.name, self.queue, self.room = name, queue, room
        self.fd, self.since_ns = fd, since_ns
        self.restart_after = restart_after
        self.counters, self.state = Counters(), Confinement.ACTIVE
        self.leaving = False
        self.ready_ns = since_ns  # suspended until then
        self.recovers_from: int | None = None  # ns; None: stays bus-off
        self.sequences = 0  # of 11 recessive bits since then

    @property
    def off(self) -> bool:
        """Whether the node is bus-off."""
        return self.state is Confinement.OFF

    def receives(self, begin: int) -> bool:
        """Whether the node receives and acknowledges a frame that begins at `begin` (ns)."""
        return self.since_ns <= begin and self.state is not Confinement.OFF
