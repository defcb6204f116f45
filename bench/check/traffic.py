"""Frames of a bus or a capture, sorted by message, with their ages, rates and faults."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.decode import SortedLog, sort_log
from slipbench.protocol.logs.frame_log import FrameLog
from slipbench.protocol.recording.log_faults import log_faults
from slipbench.protocol.recording.recording import BusFault

if TYPE_CHECKING:
    import can

NO_NAMES: Mapping[str, str] = MappingProxyType({})


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


def capture_traffic(
    path: Path, database: Database, bus: str = "", names: Mapping[str, str] = NO_NAMES
) -> BusTraffic:
    """Traffic of a capture, without the frames that its logger sent itself.

    bus    only this bus of it
    names  of its buses in the database, by their names in the capture

    Raises InputError where it cannot be read, or has no bus of such a name.
    """
    log = read_log(path).frames
    log = _renamed(log.select(~log.sent), names, str(path))
    if bus and bus in log.buses:
        log = log.select(log.bus == log.buses.index(bus))
    return BusTraffic(log, database)


def _renamed(log: FrameLog, names: Mapping[str, str], where: str) -> FrameLog:
    for bus, name in names.items():
        if bus not in log.buses:
            raise InputError(
                f"the capture has no bus {bus!r}",
                where=where,
                expected=f"the frames of {name}; its buses are {', '.join(log.buses)}",
                found=bus,
                remedy=f"name its bus: --channel {name}={log.buses[0] if log.buses else 'can0'}",
            )
    return replace(log, buses=tuple(names.get(bus, bus) for bus in log.buses))


Received = tuple[str, "can.Message"]
"""Name of a bus, and a message of python-can that it carried."""


def frame_log(received: Iterable[Received]) -> FrameLog:
    """Columns of the data frames among what was received, in order of time."""
    data_frames = (
        each for each in received if not (each[1].is_error_frame or each[1].is_remote_frame)
    )
    ordered = sorted(data_frames, key=lambda each: each[1].timestamp)
    frames = [message for _, message in ordered]
    buses = tuple(dict.fromkeys(name for name, _ in ordered))
    width = 64 if any(len(message.data) > 8 for message in frames) else 8
    data = np.zeros((len(frames), width), np.uint8)
    for row, message in enumerate(frames):
        data[row, : len(message.data)] = list(message.data)
    return FrameLog(
        time_ns=np.array([round(m.timestamp * 1e9) for m in frames], np.int64),
        bus=np.array([buses.index(name) for name, _ in ordered], np.uint8),
        identifier=np.array([m.arbitration_id for m in frames], np.uint32),
        extended=np.array([m.is_extended_id for m in frames], np.bool_),
        fd=np.array([m.is_fd for m in frames], np.bool_),
        sent=np.array([not m.is_rx for m in frames], np.bool_),
        length=np.array([len(m.data) for m in frames], np.uint8),
        data=data,
        buses=buses,
    )
