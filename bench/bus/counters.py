"""Error counters and error states of a node: the fault confinement of ISO 11898-1.

An error in a sent frame adds 8, an error in a received frame adds 1, and every successful frame
subtracts 1. So a node that disturbs the bus goes bus-off.
"""

from enum import IntEnum
from typing import NamedTuple

WARNING, PASSIVE, OFF = 96, 128, 256
REC_AFTER_PASSIVE = 119  # after a good frame; the norm allows 119 to 127


class Confinement(IntEnum):
    """Error state of a node: error-active, error warning, error-passive, bus-off."""

    ACTIVE = 0
    WARNED = 1
    PASSIVE = 2
    OFF = 3


class Counters(NamedTuple):
    """Transmit and receive error counter (TEC, REC)."""

    transmit: int = 0
    receive: int = 0

    @property
    def state(self) -> Confinement:
        """Error state that follows from the counters."""
        if self.transmit >= OFF:
            return Confinement.OFF
        most = max(self.transmit, self.receive)
        if most >= PASSIVE:
            return Confinement.PASSIVE
        return Confinement.WARNED if most >= WARNING else Confinement.ACTIVE

    def sent(self) -> "Counters":
        """Counters after a frame that was sent and acknowledged."""
        return Counters(max(self.transmit - 1, 0), self.receive)

    def received(self) -> "Counters":
        """Counters after a frame that was received."""
        receive = REC_AFTER_PASSIVE if self.receive >= PASSIVE else max(self.receive - 1, 0)
        return Counters(self.transmit, receive)

    def send_failed(self, unacknowledged: bool = False) -> "Counters":
        """Counters after an error in a sent frame.

        A missing acknowledgement does not count in the error-passive state: a single node on a bus
        never goes bus-off.
        """
        if unacknowledged and self.state is Confinement.PASSIVE:
            return self
        return Counters(self.transmit + 8, self.receive)

    def receive_failed(self) -> "Counters":
        """Counters after an error in a received frame; REC does not exceed 128."""
        return Counters(self.transmit, min(self.receive + 1, PASSIVE))
