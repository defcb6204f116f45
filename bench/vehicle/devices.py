"""The other end of the bus: device clocks, and who holds authority over an actuator."""

from dataclasses import dataclass, replace
from heapq import heappop, heappush

from slipbench.protocol.codec.messages import ActuatorCommand, Authority, BenchMessage


@dataclass(frozen=True)
class DeviceClock:
    """A device's own clock: `offset` s ahead when the simulation starts, `drift` s/s fast."""

    offset: float = 0.0
    drift: float = 0.0

    def read(self, time: float) -> float:
        """Read it at true `time` (s)."""
        return self.offset + time * (1.0 + self.drift)


RELEASED = ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Grant:
    """What a device grants the bench, from the commands that it heard.

    command    the last good command
    heard_at   s, when it came
    latched    silence ended a grant: a release must be heard before another begins
    """

    command: ActuatorCommand = RELEASED
    heard_at: float = float("-inf")
    latched: bool = False

    def hear(self, command: ActuatorCommand, now: float) -> "Grant":
        """Take in a good command at `now` (s)."""
        return Grant(command, now, self.latched and command.authority != Authority.NONE)

    def at(self, now: float, silence: float) -> "Grant":
        """Take authority back once the bench has been silent for longer than `silence` (s)."""
        if self.command.authority == Authority.NONE or now - self.heard_at <= silence:
            return self
        return replace(self, latched=True)

    @property
    def authority(self) -> Authority:
        """Tell what the bench holds."""
        return Authority.NONE if self.latched else self.command.authority


class Outbox:
    """Messages that are on their way through a device, until their latency is over."""

    def __init__(self) -> None:
        """Hold nothing."""
        self._waiting: list[tuple[float, int, str, BenchMessage]] = []
        self._sequence = 0

    def put(self, due: float, name: str, message: BenchMessage) -> None:
        """Hold `message` back until `due` (s)."""
        self._sequence += 1
        heappush(self._waiting, (due, self._sequence, name, message))

    def due(self, now: float) -> list[tuple[str, BenchMessage]]:
        """Take out what is due at `now`, in the order in which it is."""
        taken = []
        while self._waiting and self._waiting[0][0] <= now + 1e-9:
            _, _, name, message = heappop(self._waiting)
            taken.append((name, message))
        return taken
