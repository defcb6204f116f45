"""Listen on a bus for some time. Nothing is sent."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from slipbench.bench.check.traffic import BusTraffic, frame_log
from slipbench.bench.loop.clock import SECOND, Clock
from slipbench.protocol.database.layout import Database

if TYPE_CHECKING:
    import can

POLL = 0.05  # s, longest wait for a frame
MOST_WAITING = 100_000  # frames that are read after the end
WINDOW = 2.0  # s of frames that such a look shows


class Listener:
    """Frames of a bus; another thread may look at the last ones while it listens."""

    def __init__(self, bus: "can.BusABC", clock: Clock, database: Database) -> None:
        """Begin without frames."""
        self._bus, self._clock, self._database = bus, clock, database
        self._frames: list[can.Message] = []
        self._last = clock.now_ns()

    def listen(self, duration: float, stop: Callable[[], bool] = lambda: False) -> BusTraffic:
        """Frames that arrive within `duration` (s), or until `stop`, and those that wait at its end."""
        ends = self._clock.now_ns() + round(duration * SECOND)
        while self._clock.now_ns() < ends and not stop():
            self._take(self._bus.recv(POLL))
        for _ in range(MOST_WAITING):
            if not self._take(self._bus.recv(0)):
                break
        return _traffic(self._frames, self._database, self._clock.now_ns() - self._last)

    def recent(self) -> BusTraffic:
        """Frames of the last seconds."""
        waited = self._clock.now_ns() - self._last
        return _traffic(_recent(self._frames.copy()), self._database, waited)

    def _take(self, message: "can.Message | None") -> bool:
        if message is None:
            return False
        self._frames.append(message)
        self._last = self._clock.now_ns()
        return True


def _recent(frames: "list[can.Message]") -> "list[can.Message]":
    """The frames of the last seconds, by their own stamps."""
    if not frames:
        return []
    since = frames[-1].timestamp - WINDOW
    first = next(
        (place for place in range(len(frames) - 1, -1, -1) if frames[place].timestamp < since), -1
    )
    return frames[first + 1 :]


def _traffic(frames: "list[can.Message]", database: Database, waited_ns: int) -> BusTraffic:
    """Traffic that ended `waited_ns` after its last frame, on the clock of the frames."""
    log = frame_log(frames)
    return BusTraffic(log, database, int(log.time_ns[-1]) + waited_ns if len(log) else None)
