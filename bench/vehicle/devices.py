"""Devices of the motorcycle: their clocks, the authority that they grant, their latency."""

from dataclasses import dataclass, replace
from heapq import heappop, heappush

from slipbench.protocol.codec.messages import ActuatorCommand, Authority, BenchMessage


@dataclass(frozen=True)
class DeviceClock:
    """Clock of a device. offset: s, at the start of the simulation; drift: s/s."""

    offset: float = 0.0
    drift: float = 0.0

    def read(self, time: float) -> float:
        """Time of the device's clock in s, at true `time` (s)."""
        return self.offset + time * (1.0 + self.drift)


RELEASED = ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Grant:
    """Authority that a device grants the bench, from the commands that it received.

    command      last valid command
    received_at  s, when it arrived
    latched      the watchdog ended a grant: a release must arrive before authority is granted again
    latches      False where no release can arrive: the next request is granted again
    """

    command: ActuatorCommand = RELEASED
    received_at: float = float("-inf")
    latched: bool = False
    latches: bool = True

    def receive(self, command: ActuatorCommand, now: float) -> "Grant":
        """Grant after a valid command at `now` (s)."""
        latched = self.latched and command.authority != Authority.NONE
        return Grant(command, now, latched, self.latches)

    def with_watchdog(self, now: float, silence: float) -> "Grant":
        """Grant at `now` (s): none after `silence` s without a command (watchdog timeout)."""
        if self.command.authority == Authority.NONE or now - self.received_at <= silence:
            return self
        return replace(self, latched=True) if self.latches else Grant(latches=False)

    @property
    def authority(self) -> Authority:
        """Authority of the bench."""
        return Authority.NONE if self.latched else self.command.authority


class Outbox:
    """Messages inside a device, until its latency is over."""

    def __init__(self) -> None:
        """Start empty."""
        self._waiting: list[tuple[float, int, str, BenchMessage]] = []
        self._sequence = 0

    def put(self, due: float, name: str, message: BenchMessage) -> None:
        """Add a message that is sent at `due` (s)."""
        self._sequence += 1
        heappush(self._waiting, (due, self._sequence, name, message))

    def due(self, now: float) -> list[tuple[str, BenchMessage]]:
        """Remove and return the messages that are due at `now` (s), earliest first."""
        taken = []
        while self._waiting and self._waiting[0][0] <= now + 1e-9:
            _, _, name, message = heappop(self._waiting)
            taken.append((name, message))
        return taken
