"""Load of each bus over the last half second, from frames that come in pieces."""

import numpy as np

from slipbench.bench.loop.clock import SECOND
from slipbench.protocol.codec.frame_bits import frame_bits
from slipbench.protocol.logs.frame_log import FrameLog

WINDOW = 100_000_000  # ns
WINDOWS = 5  # the last complete ones are averaged


class RecentLoad:
    """Time that frames took on each bus, by windows of the recording's clock."""

    def __init__(self, bitrate: float) -> None:
        """Begin without a frame. bitrate: bit/s; 0: unknown, so that no load is."""
        self._bitrate = bitrate
        self._taken: dict[str, dict[int, float]] = {}
        self._newest = 0

    def add(self, log: FrameLog) -> None:
        """Add the frames of a log, stuff bits and interframe space counted exactly."""
        if not self._bitrate or not len(log):
            return
        bits = frame_bits(log)
        taken = (bits.nominal + bits.data) / self._bitrate
        window = log.time_ns // WINDOW
        self._newest = max(self._newest, int(window.max()))
        for number, bus in enumerate(log.buses):
            sums = self._taken.setdefault(bus, {})
            here = log.bus == number
            for each in np.unique(window[here]).tolist():
                share = float(taken[here & (window == each)].sum())
                sums[each] = sums.get(each, 0.0) + share
            for old in [each for each in sums if each < self._newest - WINDOWS]:
                del sums[old]

    def shares(self) -> dict[str, float]:
        """Load of each bus over the last complete windows, 0..1; without one it is left out."""
        return {bus: self._share(sums) for bus, sums in self._taken.items() if len(sums) > 1}

    def _share(self, sums: dict[int, float]) -> float:
        """Mean over the complete windows since the first frame of the bus."""
        first = max(min(sums), self._newest - WINDOWS)
        complete = [sums.get(each, 0.0) for each in range(first, self._newest)]
        return sum(complete) * SECOND / (WINDOW * len(complete)) if complete else 0.0
