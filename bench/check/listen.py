"""Listen on a bus for some time. Nothing is sent."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from slipbench.bench.check.traffic import BusTraffic, frame_log
from slipbench.bench.loop.clock import SECOND, Clock
from slipbench.protocol.database.layout import Database

if TYPE_CHECKING:
    import can

POLL = 0.05  # s, longest wait for a frame
REFRESH = 0.5  # s, between two looks at the last frames
WINDOW = 2.0  # s of frames that such a look shows


def listen(
    bus: "can.BusABC",
    clock: Clock,
    database: Database,
    duration: float,
    stop: Callable[[], bool] = lambda: False,
    shown: Callable[[BusTraffic], None] | None = None,
) -> BusTraffic:
    """Frames of a bus within `duration` (s), or until `stop`.

    shown: is given the frames of the last seconds from time to time.
    """
    frames: list[can.Message] = []
    start = clock.now_ns()
    ends, look, last = start + round(duration * SECOND), start, start
    while clock.now_ns() < ends and not stop():
        message = bus.recv(POLL)
        if message is not None:
            frames.append(message)
            last = clock.now_ns()
        if shown is not None and clock.now_ns() >= look:
            shown(_traffic(_recent(frames), database, clock.now_ns() - last))
            look = clock.now_ns() + round(REFRESH * SECOND)
    return _traffic(frames, database, clock.now_ns() - last)


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
