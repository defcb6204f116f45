"""Arrival time of a frame on the monotonic clock of the bench.

SocketCAN stamps frames with wall time. A machine that is set by a time server in the middle of a
trial would leave a gap in the record, or an overlap.
"""

from collections.abc import Callable

from slipbench.bench.loop.clock import SECOND, MonotonicClock

# Turns python-can's time stamp of a frame (s) into ns on the recording's clock.
Stamp = Callable[[float], int]


def as_stamped(timestamp: float) -> int:
    """Time stamp in ns, unchanged, from a clock that is never set."""
    return round(timestamp * SECOND)


class SteadyStamps:
    """Wall-time stamps minus the steps of the wall clock since `clock` was made.

    A frame that waited while the clock was set is dated between the previous frame and now.
    """

    def __init__(self, clock: MonotonicClock) -> None:
        """Begin at the present time of `clock`."""
        self._clock, self._last = clock, 0

    def __call__(self, timestamp: float) -> int:
        """Time in ns on the clock: not before the previous frame, not in the future."""
        time_ns = round(timestamp * SECOND) - self._clock.set_by_ns()
        self._last = min(max(time_ns, self._last), self._clock.now_ns())
        return self._last
