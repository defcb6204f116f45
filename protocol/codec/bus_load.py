"""Bus load, from a recording."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec.frame_bits import frame_bits
from slipbench.protocol.logs.frame_log import FrameLog

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class BusLoad:
    """Share of time that frames take, stuff bits and interframe space counted exactly.

    time   (k,) s since the log's start, beginning of each window
    load   (k,) 0..1 in each window; the last window counts only as long as the log lasts
    mean   0..1 over the whole log
    """

    time: FloatArray
    load: FloatArray
    mean: float

    @property
    def peak(self) -> float:
        """Highest load of a window."""
        return float(self.load.max(initial=0.0))


MOST = 1_000_000  # windows: a day of 0.1 s


def bus_load(
    log: FrameLog, bitrate: float, data_bitrate: float | None = None, window: float = 0.1
) -> Mapping[str, BusLoad]:
    """Load of each bus of a log. bitrate, data_bitrate: bit/s; window: s.

    data_bitrate is that of CAN FD frames after their rate switch; None: they do not switch. A frame
    counts where its time stamp lies. Windows are widened where there would be more than MOST: one
    damaged time stamp makes a log of years.
    """
    bits = frame_bits(log)
    taken: FloatArray = bits.nominal / float(bitrate) + bits.data / float(data_bitrate or bitrate)
    start = int(log.time_ns.min(initial=np.iinfo(np.int64).max))
    times = np.asarray((log.time_ns - start) * 1e-9, np.float64)
    duration = float(times.max(initial=0.0))
    window = max(window, duration / MOST)
    edges: FloatArray = np.arange(max(1, int(np.ceil(duration / window))), dtype=float) * window
    lasts = np.maximum(np.minimum(duration - edges, window), 0.0)
    place = np.minimum((times / window).astype(np.int64), edges.size - 1)
    return {
        name: _load(edges, lasts, place[log.bus == bus], taken[log.bus == bus])
        for bus, name in enumerate(log.buses)
    }


def _load(
    edges: FloatArray, lasts: FloatArray, place: npt.NDArray[np.int64], taken: FloatArray
) -> BusLoad:
    sums = np.bincount(place, weights=taken, minlength=edges.size)
    loads = np.divide(sums, lasts, out=np.zeros(edges.size), where=lasts > 0)
    total = float(lasts.sum())
    return BusLoad(edges, loads, float(taken.sum()) / total if total else 0.0)
