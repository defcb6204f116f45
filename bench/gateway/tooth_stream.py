"""Tooth frames as they arrive become tooth times on the bench's clock, for a controller.

Every interval of an encoder is exact; the offset of its clock is unknown. The
bench places the stream as late as possible, but no tooth later than its frame: the frame with the
least delay in the last seconds gives the delay of the others.
"""

import math

from slipbench.protocol.codec.messages import Intervals, ToothIntervals

DRIFT = 2e-4  # s per s by which two clocks may drift apart, with reserve


class ToothStream:
    """Teeth of one encoder in order, with running count and time."""

    def __init__(self, modulo: int) -> None:
        """modulo: of the count in the frames."""
        self._modulo = modulo
        self._count: int | None = None
        self._elapsed = 0.0  # s, the stream's own time of its last tooth
        self._late = math.inf  # s, bench's clock less the stream's own time, the least of late
        self._heard = 0.0

    def take(self, message: ToothIntervals, now: float) -> list[tuple[float, int]]:
        """Teeth of a frame: time on the clock of the bench (s), running count.

        After lost teeth the count steps by as many, and the time goes on from the frame's arrival.
        """
        if message.layout == Intervals.STANDING or not message.intervals:
            return []
        reported = len(message.intervals)
        if self._count is None:
            self._count = message.tooth_count - reported
        lost = (message.tooth_count - reported - self._count) % self._modulo
        if lost:  # their duration is unknown: restart the minimum of the delay
            self._late = math.inf
        elapsed, first = self._elapsed, self._count + lost
        teeth = []
        for k, interval in enumerate(message.intervals, 1):
            elapsed += interval
            teeth.append((elapsed, first + k))
        self._count, self._elapsed = first + reported, elapsed
        self._late = min(self._late + DRIFT * (now - self._heard), now - elapsed)
        self._heard = now
        return [(time + self._late, count) for time, count in teeth]
