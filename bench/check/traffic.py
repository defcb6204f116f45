"""Frames of a bus or a capture, sorted by message, with their ages, rates and faults."""

from collections.abc import Iterable
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from slipbench.protocol.database.layout import Database
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.decode import SortedLog, sort_log
from slipbench.protocol.logs.frame_log import FrameLog
from slipbench.protocol.recording.log_faults import log_faults
from slipbench.protocol.recording.recording import BusFault

if TYPE_CHECKING:
    import can


class BusTraffic:
    """Frames that were received. end_ns: when listening ended, on the clock of the frames."""

    def __init__(self, log: FrameLog, database: Database, end_ns: int | None = None) -> None:
        """Sort the frames by message."""
        self.log, self.database = log, database
        self.sorted: SortedLog = sort_log(log, database)
        self.start_ns = int(log.time_ns[0]) if len(log) else 0
        last = int(log.time_ns[-1]) if len(log) else 0
        self.end_ns = last if end_ns is None else max(end_ns, last)

    @cached_property
    def faults(self) -> tuple[BusFault, ...]:
        """Faults of the frames, counted by message."""
        return log_faults(self.sorted)

    @property
    def duration(self) -> float:
        """Time from the first frame to the end, s."""
        return (self.end_ns - self.start_ns) * 1e-9

    def times(self, rows: npt.NDArray[np.intp]) -> npt.NDArray[np.float64]:
        """Times of frames since the first one, s, (n,)."""
        return np.asarray((self.log.time_ns[rows] - self.start_ns) * 1e-9, np.float64)

    def age(self, message: str) -> float:
        """Time since the last frame of a message that came, s."""
        rows = self.sorted.frames[message].rows
        return (self.end_ns - int(self.log.time_ns[rows[-1]])) * 1e-9

    def rate(self, message: str) -> float:
        """Frames of a message per second, between its first and its last one."""
        times = self.log.time_ns[self.sorted.frames[message].rows]
        span = int(times[-1] - times[0]) if times.size > 1 else 0
        return (times.size - 1) / (span * 1e-9) if span else 0.0


def capture_traffic(path: Path, database: Database, bus: str = "") -> BusTraffic:
    """Traffic of a capture, without the frames that its logger sent itself.

    bus: only this bus of it. Raises InputError where it cannot be read.
    """
    log = read_log(path).frames
    log = log.select(~log.sent)
    if bus and bus in log.buses:
        log = log.select(log.bus == log.buses.index(bus))
    return BusTraffic(log, database)


def frame_log(messages: "Iterable[can.Message]") -> FrameLog:
    """Columns of the data frames among messages of python-can, in order of time."""
    frames = sorted(
        (m for m in messages if not (m.is_error_frame or m.is_remote_frame)),
        key=lambda message: message.timestamp,
    )
    width = 64 if any(len(message.data) > 8 for message in frames) else 8
    data = np.zeros((len(frames), width), np.uint8)
    for row, message in enumerate(frames):
        data[row, : len(message.data)] = list(message.data)
    return FrameLog(
        time_ns=np.array([round(m.timestamp * 1e9) for m in frames], np.int64),
        bus=np.zeros(len(frames), np.uint8),
        identifier=np.array([m.arbitration_id for m in frames], np.uint32),
        extended=np.array([m.is_extended_id for m in frames], np.bool_),
        fd=np.array([m.is_fd for m in frames], np.bool_),
        sent=np.array([not m.is_rx for m in frames], np.bool_),
        length=np.array([len(m.data) for m in frames], np.uint8),
        data=data,
        buses=("bus",),
    )
