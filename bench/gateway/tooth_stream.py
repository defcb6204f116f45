"""Tooth frames as they arrive become tooth times on the bench's clock, for a controller.

Inside an encoder's stream every interval is exact; what is not known is when it all happened. The
bench lays the stream so that no tooth is later than the frame that told it, and as late as that
allows: the quickest frame of the last seconds says how late the others came.
"""

import math

from slipbench.protocol.codec.messages import Intervals, ToothIntervals

DRIFT = 2e-4  # s per s by which two clocks may drift apart, with reserve


class ToothStream:
    """One encoder's teeth, in order; keeps their running count and their place in time."""

    def __init__(self, modulo: int) -> None:
        """Know nothing. modulo: at which the frames' count wraps."""
        self._modulo = modulo
        self._count: int | None = None
        self._elapsed = 0.0  # s, the stream's own time of its last tooth
        self._late = math.inf  # s, bench's clock less the stream's own time, the least of late
        self._heard = 0.0

    def take(self, message: ToothIntervals, now: float) -> list[tuple[float, int]]:
        """Return the teeth that a frame tells: time on the bench's clock (s), running count.

        After lost teeth the count steps by as many, and the time goes on from the frame's arrival.
        """
        if message.layout == Intervals.STANDING or not message.intervals:
            return []
        told = len(message.intervals)
        if self._count is None:
            self._count = message.tooth_count - told
        lost = (message.tooth_count - told - self._count) % self._modulo
        elapsed = now - self._late if lost else self._elapsed  # what was lost took that long
        first = self._count + lost
        teeth = []
        if lost:
            elapsed = max(elapsed - sum(message.intervals), self._elapsed)
        for k, interval in enumerate(message.intervals, 1):
            elapsed += interval
            teeth.append((elapsed, first + k))
        self._count, self._elapsed = first + told, elapsed
        self._late = min(self._late + DRIFT * (now - self._heard), now - elapsed)
        self._heard = now
        return [(time + self._late, count) for time, count in teeth]
