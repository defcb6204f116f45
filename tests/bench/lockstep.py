"""A virtual motorcycle on the simulated bus with nobody at the gateway but the test itself."""

import can

from slipbench import dbc
from slipbench.bench.bus.simulated_bus import SimulatedBus
from slipbench.bench.loop.clock import MILLISECOND, SECOND
from slipbench.bench.vehicle.virtual_motorcycle import Scenario, VirtualMotorcycle
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.database.database import load_database


class LockStep:
    """The test sends what it likes, a millisecond passes, and the test reads what was said."""

    def __init__(self, scenario: Scenario) -> None:
        self.codec = Codec(load_database(dbc.MOTORBIKE))
        self._wire = SimulatedBus(1_000_000)
        self._ours, self._theirs = self._wire.node("test"), self._wire.node("motorcycle")
        self.motorcycle = VirtualMotorcycle(scenario, self._theirs, self.codec)
        self._number = 0

    def __enter__(self) -> "LockStep":
        return self

    def __exit__(self, *_: object) -> None:
        self._ours.shutdown()
        self._theirs.shutdown()

    def send(self, identifier: int, data: bytes) -> None:
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        self._ours.send(message)

    def live(self) -> None:
        """Let a millisecond pass."""
        due = SECOND + (self._number + 1) * MILLISECOND
        self._wire.advance_to(due - MILLISECOND // 2)
        self.motorcycle.tick(self._number, due - MILLISECOND // 2)
        self._wire.advance_to(due)
        self._number += 1

    def heard(self):
        """Every message since the last look, with its time in s since the start."""
        said = []
        while (frame := self._ours.recv(0)) is not None:
            decoded = self.codec.decode(frame.arbitration_id, frame.data)
            said.append((frame.timestamp - 1.0, decoded))
        return said
