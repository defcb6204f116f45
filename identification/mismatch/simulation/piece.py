"""A piece of a recording: runs/lap@0:60 is its first minute, runs/lap@60: the remainder."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np

from slipbench.identification.signals.clocks import BUS
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.table_recording import read_recording


@dataclass(frozen=True)
class Piece:
    """start, end: s since the recording's start."""

    folder: Path
    start: float = -math.inf
    end: float = math.inf

    @classmethod
    def of(cls, path: Path) -> Self:
        """Parse `folder@start:end`; a path without @ is the entire recording.

        Raises InputError where the span is not valid.
        """
        head, at, span = path.name.rpartition("@")
        if not at or path.exists():
            return cls(path)
        first, colon, last = span.partition(":")
        try:
            start, end = (float(first) if first else -math.inf, float(last) if last else math.inf)
        except ValueError:
            start, end = 0.0, 0.0
        if not colon or not start < end:
            raise InputError(
                f"{span!r} is not a segment of a recording",
                where=str(path),
                expected="seconds since its start, as in run@0:60, run@60: or run@:60",
            )
        return cls(path.with_name(head), start, end)

    def meets(self, other: "Piece") -> bool:
        """Return whether both overlap in time in one recording."""
        same = self.folder.resolve() == other.folder.resolve()
        return same and self.start < other.end and other.start < self.end

    def read(self) -> Recording:
        """Read the recording, cut to the piece."""
        recording = read_recording(self.folder)
        if math.isinf(self.start) and math.isinf(self.end):
            return recording
        cut = {role: self._cut(channel) for role, channel in recording.channels.items()}
        name = f"{recording.folder.name}@{self._edge(self.start)}:{self._edge(self.end)}"
        return replace(recording, folder=recording.folder.with_name(name), channels=cut)

    def _cut(self, channel: Channel) -> Channel:
        if channel.clock != BUS and channel.arrival is None:
            return channel  # its time on the bus is unknown
        time = channel.time if channel.arrival is None else channel.arrival
        keep: np.ndarray[tuple[int], np.dtype[np.bool_]] = (time >= self.start) & (time < self.end)
        arrival = None if channel.arrival is None else channel.arrival[keep]
        return replace(channel, time=channel.time[keep], value=channel.value[keep], arrival=arrival)

    @staticmethod
    def _edge(time: float) -> str:
        return "" if math.isinf(time) else f"{time:g}"
