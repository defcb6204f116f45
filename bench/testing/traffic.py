"""Traffic of a bus during a test: frames in order, and signals of them by name."""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from slipbench.bench.bus.frame_content import counter_in, crc_correct
from slipbench.bench.testing.conditions import SignalOf
from slipbench.protocol.codec import e2e
from slipbench.protocol.database.layout import Message

Floats = npt.NDArray[np.float64]


class TrafficFrame(NamedTuple):
    """One received frame. time_ns: on the clock of the bus; flags: of `bench/loop/ring.py`."""

    time_ns: int
    identifier: int
    flags: int
    data: bytes


@dataclass
class Traffic:
    """All frames of a bus since `origin_ns`, and those of each identifier."""

    origin_ns: int
    frames: list[TrafficFrame] = field(default_factory=list)
    errors: int = 0  # error frames
    _of: dict[tuple[int, bool], list[TrafficFrame]] = field(default_factory=dict)

    def add(self, frame: TrafficFrame, extended: bool) -> None:
        """Append a data frame."""
        self.frames.append(frame)
        self._of.setdefault((frame.identifier, extended), []).append(frame)

    def of(self, message: Message) -> list[TrafficFrame]:
        """Frames of a message, in order of their arrival."""
        return self._of.get((message.identifier, message.extended), [])

    def seconds(self, frame: TrafficFrame) -> float:
        """Time of a frame in s since the bus began."""
        return (frame.time_ns - self.origin_ns) * 1e-9

    def times(self, message: Message) -> Floats:
        """Times of the frames of a message, s, shape (n,)."""
        return np.array([self.seconds(frame) for frame in self.of(message)])

    def trace(self, of: SignalOf, since: float = 0.0) -> tuple[Floats, Floats]:
        """Times (s) and values (database's unit) of a signal from `since` (s) on, shape (n,) each."""
        earliest = self.origin_ns + round(since * 1e9)
        found = [
            (self.seconds(frame), value)
            for frame in self.of(of.message)
            if frame.time_ns >= earliest and (value := of.value(frame.data)) is not None
        ]
        columns = np.array(found, float).reshape(-1, 2)
        return columns[:, 0], columns[:, 1]

    def last(self, of: SignalOf) -> tuple[float, float] | None:
        """Time (s) and value (database's unit) of the last frame that holds a signal, or None."""
        for frame in reversed(self.of(of.message)):
            if (value := of.value(frame.data)) is not None:
                return self.seconds(frame), value
        return None

    def faults(self, message: Message, timeout: float) -> list[tuple[float, str]]:
        """Time (s) and fault of each faulty frame of a message: length, CRC, counter, gap.

        timeout  s between two frames after which the second one is stale
        """
        found: list[tuple[float, str]] = []
        state = e2e.INITIAL
        for frame in self.of(message):
            now = self.seconds(frame)
            if len(frame.data) < message.length:
                found.append((now, "too short"))
                continue
            counter = counter_in(message, frame.data)
            if counter is None:
                continue
            correct = crc_correct(message, frame.data)
            state, fault = e2e.check(state, counter, correct, now, timeout)
            if fault is not None:
                found.append((now, str(fault.fault)))
        return found
