"""A controller on the wire: its counters, and the frames that wait in it."""

from slipbench.bench.bus.counters import Confinement, Counters
from slipbench.bench.bus.queues import Queue

ROOM = 1000  # frames that wait in a node unless it says otherwise


class Node:
    """One controller. Made by `Wire.attach`; only its wire changes it."""

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

    def hears(self, begin: int) -> bool:
        """Tell whether the node follows, and acknowledges, a frame that begins at `begin` (ns)."""
        return self.since_ns <= begin and self.state is not Confinement.OFF
