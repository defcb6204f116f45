"""Transmit queues of a controller: first in, first out, or the most urgent frame first.

An adapter with one queue sends in order, and a frame of low priority delays all frames behind it. A
controller with mailboxes, or several devices behind one node, send their most urgent frame first.
`ready_ns` is the time since which a frame has been ready, and None while there is none.
"""

import heapq
from collections import deque

from slipbench.bench.bus.frame import Frame


class InOrder:
    """First in, first out: only the first frame takes part in arbitration."""

    def __init__(self) -> None:
        """Start empty."""
        self.ready_ns: int | None = None
        self._frames: deque[tuple[int, Frame]] = deque()

    def __len__(self) -> int:
        """Number of frames in the queue."""
        return len(self._frames)

    def push(self, time_ns: int, frame: Frame) -> None:
        """Add a frame at `time_ns`; times never decrease."""
        self._frames.append((time_ns, frame))
        self.ready_ns = self._frames[0][0]

    def first(self, time_ns: int) -> Frame:
        """Frame that takes part in arbitration at `time_ns`, when one is ready."""
        return self._frames[0][1]

    def pop(self) -> None:
        """Remove the frame that `first` returned last."""
        self._frames.popleft()
        self.ready_ns = self._frames[0][0] if self._frames else None

    def clear(self) -> int:
        """Number of frames that were removed: all of them."""
        count = len(self._frames)
        self._frames.clear()
        self.ready_ns = None
        return count


class MostUrgent:
    """Mailboxes: the ready frame with the lowest identifier takes part in arbitration."""

    def __init__(self) -> None:
        """Start empty."""
        self.ready_ns: int | None = None
        self._coming: deque[tuple[int, Frame]] = deque()
        self._ready: list[tuple[int, int, int, Frame]] = []  # priority, number, ready since, frame
        self._number = 0

    def __len__(self) -> int:
        """Number of frames in the queue."""
        return len(self._coming) + len(self._ready)

    def push(self, time_ns: int, frame: Frame) -> None:
        """Add a frame at `time_ns`; times never decrease."""
        self._coming.append((time_ns, frame))
        if self.ready_ns is None:
            self.ready_ns = time_ns

    def first(self, time_ns: int) -> Frame:
        """Frame that takes part in arbitration at `time_ns`, when one is ready."""
        while self._coming and self._coming[0][0] <= time_ns:
            since, frame = self._coming.popleft()
            self._number += 1
            heapq.heappush(self._ready, (frame.priority, self._number, since, frame))
        return self._ready[0][3]

    def pop(self) -> None:
        """Remove the frame that `first` returned last."""
        heapq.heappop(self._ready)
        if self._ready:
            self.ready_ns = self._ready[0][2]
        else:
            self.ready_ns = self._coming[0][0] if self._coming else None

    def clear(self) -> int:
        """Number of frames that were removed: all of them."""
        count = len(self)
        self._coming.clear()
        self._ready.clear()
        self.ready_ns = None
        return count


Queue = InOrder | MostUrgent
