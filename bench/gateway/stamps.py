"""When a frame arrived, on the bench's own clock, which nobody can set.

SocketCAN stamps frames with wall time. A machine that is set by a time server in the midst of a
trial would tear the record apart, or fold it back over itself.
"""

from collections.abc import Callable

from slipbench.bench.loop.clock import SECOND, MonotonicClock

# Turns python-can's time stamp of a frame (s) into ns on the recording's clock.
Stamp = Callable[[float], int]


def as_stamped(timestamp: float) -> int:
    """Believe the stamp: it was made by a clock that is not set."""
    return round(timestamp * SECOND)


class SteadyStamps:
    """Takes out of wall-time stamps by how much the wall clock was set since `clock` was made.

    A frame that waited while the clock was set is put between the one before it and now.
    """

    def __init__(self, clock: MonotonicClock) -> None:
        """Begin now."""
        self._clock, self._last = clock, 0

    def __call__(self, timestamp: float) -> int:
        """Give ns on the clock, never before the frame before, never in the future."""
        time_ns = round(timestamp * SECOND) - self._clock.set_by_ns()
        self._last = min(max(time_ns, self._last), self._clock.now_ns())
        return self._last
