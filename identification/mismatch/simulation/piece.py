"""A piece of a recording: runs/lap@0:60 is its first minute, runs/lap@60: what comes after."""

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
        """Take `folder@start:end` apart; a path without @ is the whole recording."""
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
        """Tell whether both have some time of one recording."""
        same = self.folder.resolve() == other.folder.resolve()
        return same and self.start < other.end and other.start < self.end

    def read(self) -> Recording:
        """Read the recording, cut to the piece."""
        whole = read_recording(self.folder)
        if math.isinf(self.start) and math.isinf(self.end):
            return whole
        cut = {role: self._cut(channel) for role, channel in whole.channels.items()}
        name = f"{whole.folder.name}@{self._edge(self.start)}:{self._edge(self.end)}"
        return replace(whole, folder=whole.folder.with_name(name), channels=cut)

    def _cut(self, channel: Channel) -> Channel:
        if channel.clock != BUS and channel.arrival is None:
            return channel  # nobody knows which part of it belongs here
        time = channel.time if channel.arrival is None else channel.arrival
        keep: np.ndarray[tuple[int], np.dtype[np.bool_]] = (time >= self.start) & (time < self.end)
        arrival = None if channel.arrival is None else channel.arrival[keep]
        return replace(channel, time=channel.time[keep], value=channel.value[keep], arrival=arrival)

    @staticmethod
    def _edge(time: float) -> str:
        return "" if math.isinf(time) else f"{time:g}"
