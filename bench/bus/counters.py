"""A node's error counters, and what they make of it: the fault confinement of ISO 11898-1.

The counters rise by 8 with an error in what the node sends and by 1 with one in what it hears,
and fall by 1 with every frame that succeeds. So a node that disturbs the bus takes itself off it.
"""

from enum import IntEnum
from typing import NamedTuple

WARNING, PASSIVE, OFF = 96, 128, 256
HEARD_AGAIN = 119  # a passive listener's counter after a good frame; the norm allows 119..127


class Confinement(IntEnum):
    """How far a node is trusted with the bus."""

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
        """Tell how far the node is trusted."""
        if self.transmit >= OFF:
            return Confinement.OFF
        most = max(self.transmit, self.receive)
        if most >= PASSIVE:
            return Confinement.PASSIVE
        return Confinement.WARNED if most >= WARNING else Confinement.ACTIVE

    def sent(self) -> "Counters":
        """Count a frame that was sent and acknowledged."""
        return Counters(max(self.transmit - 1, 0), self.receive)

    def heard(self) -> "Counters":
        """Count a frame that was received."""
        receive = HEARD_AGAIN if self.receive >= PASSIVE else max(self.receive - 1, 0)
        return Counters(self.transmit, receive)

    def send_failed(self, unacknowledged: bool = False) -> "Counters":
        """Count an error in a frame of its own.

        A passive node that merely nobody acknowledges stays as it is: a lone node never goes off.
        """
        if unacknowledged and self.state is Confinement.PASSIVE:
            return self
        return Counters(self.transmit + 8, self.receive)

    def hearing_failed(self) -> "Counters":
        """Count an error in a frame of another; the counter stays where it cannot fall from."""
        return Counters(self.transmit, min(self.receive + 1, PASSIVE))
