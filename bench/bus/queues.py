"""Frames that wait in a controller for the wire: in the order of sending, or the most urgent first.

An adapter with one queue sends in order, and a frame of low priority holds up all behind it. A
controller with mailboxes, and several devices behind one node, offer their most urgent frame.
Both tell in `ready_ns` since when they have had a frame to offer, and None while they have none.
"""

import heapq
from collections import deque

from slipbench.bench.bus.frame import Frame


class InOrder:
    """One queue: only its first frame contends."""

    def __init__(self) -> None:
        """Hold nothing."""
        self.ready_ns: int | None = None
        self._frames: deque[tuple[int, Frame]] = deque()

    def __len__(self) -> int:
        """Count the frames that wait."""
        return len(self._frames)

    def push(self, time_ns: int, frame: Frame) -> None:
        """Take in a frame; times never go back."""
        self._frames.append((time_ns, frame))
        self.ready_ns = self._frames[0][0]

    def first(self, time_ns: int) -> Frame:
        """Give the frame that contends at `time_ns`, at which one is ready."""
        return self._frames[0][1]

    def pop(self) -> None:
        """Remove the frame that `first` gave last."""
        self._frames.popleft()
        self.ready_ns = self._frames[0][0] if self._frames else None

    def clear(self) -> int:
        """Forget every frame; returns how many there were."""
        count = len(self._frames)
        self._frames.clear()
        self.ready_ns = None
        return count


class MostUrgent:
    """Mailboxes: of all frames that are ready the one with the lowest identifier contends."""

    def __init__(self) -> None:
        """Hold nothing."""
        self.ready_ns: int | None = None
        self._coming: deque[tuple[int, Frame]] = deque()
        self._ready: list[tuple[int, int, int, Frame]] = []  # priority, number, ready since, frame
        self._number = 0

    def __len__(self) -> int:
        """Count the frames that wait."""
        return len(self._coming) + len(self._ready)

    def push(self, time_ns: int, frame: Frame) -> None:
        """Take in a frame; times never go back."""
        self._coming.append((time_ns, frame))
        if self.ready_ns is None:
            self.ready_ns = time_ns

    def first(self, time_ns: int) -> Frame:
        """Give the frame that contends at `time_ns`, at which one is ready."""
        while self._coming and self._coming[0][0] <= time_ns:
            since, frame = self._coming.popleft()
            self._number += 1
            heapq.heappush(self._ready, (frame.priority, self._number, since, frame))
        return self._ready[0][3]

    def pop(self) -> None:
        """Remove the frame that `first` gave last."""
        heapq.heappop(self._ready)
        if self._ready:
            self.ready_ns = self._ready[0][2]
        else:
            self.ready_ns = self._coming[0][0] if self._coming else None

    def clear(self) -> int:
        """Forget every frame; returns how many there were."""
        count = len(self)
        self._coming.clear()
        self._ready.clear()
        self.ready_ns = None
        return count


Queue = InOrder | MostUrgent
