"""Listen on one bus or several for some time. Nothing is sent."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from slipbench.bench.check.traffic import BusTraffic, Received, frame_log
from slipbench.bench.loop.clock import SECOND, Clock
from slipbench.protocol.database.layout import Database

if TYPE_CHECKING:
    import can

POLL = 0.05  # s, longest wait for a frame
IN_TURN = 0.002  # s, the same, where several buses are read in turn
MOST_WAITING = 100_000  # frames that are read after the end
WINDOW = 2.0  # s of frames that such a look shows


class Listener:
    """Frames of buses; another thread may look at the last ones while it listens."""

    def __init__(self, buses: "Mapping[str, can.BusABC]", clock: Clock, database: Database) -> None:
        """Begin without frames. buses: by the names that the database has for them."""
        self._buses, self._clock, self._database = buses, clock, database
        self._frames: list[Received] = []
        self._poll = POLL if len(buses) == 1 else IN_TURN
        self._last = clock.now_ns()

    def listen(self, duration: float, stop: Callable[[], bool] = lambda: False) -> BusTraffic:
        """Frames that arrive within `duration` (s), or until `stop`, and those that wait at its end."""
        ends = self._clock.now_ns() + round(duration * SECOND)
        while self._clock.now_ns() < ends and not stop():
            for name, bus in self._buses.items():
                self._take(name, bus.recv(self._poll))
        for name, bus in self._buses.items():
            self._drain(name, bus)
        return _traffic(self._frames, self._database, self._clock.now_ns() - self._last)

    def recent(self) -> BusTraffic:
        """Frames of the last seconds."""
        waited = self._clock.now_ns() - self._last
        return _traffic(_recent(self._frames.copy()), self._database, waited)

    def _drain(self, name: str, bus: "can.BusABC") -> None:
        for _ in range(MOST_WAITING):
            if not self._take(name, bus.recv(0)):
                break

    def _take(self, name: str, message: "can.Message | None") -> bool:
        if message is None:
            return False
        self._frames.append((name, message))
        self._last = self._clock.now_ns()
        return True


def _recent(frames: list[Received]) -> list[Received]:
    """The frames of the last seconds, by their own stamps."""
    if not frames:
        return []
    since = frames[-1][1].timestamp - WINDOW
    places = range(len(frames) - 1, -1, -1)
    first = next((place for place in places if frames[place][1].timestamp < since), -1)
    return frames[first + 1 :]


def _traffic(frames: list[Received], database: Database, waited_ns: int) -> BusTraffic:
    """Traffic that ended `waited_ns` after its last frame, on the clock of the frames."""
    log = frame_log(frames)
    return BusTraffic(log, database, int(log.time_ns[-1]) + waited_ns if len(log) else None)
