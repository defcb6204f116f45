"""Fields of the encoders' frames as columns."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec.messages import Intervals
from slipbench.protocol.codec.unwrap import unwrap_clock
from slipbench.protocol.logs.decode import Frames

IntArray = npt.NDArray[np.int64]
MICROSECOND = 1_000  # ns


@dataclass(frozen=True)
class ToothFrames:
    """n tooth frames, as sent.

    count     (n,) running count of the last tooth, modulo `modulo`
    intervals (n, k) us, oldest first, 0 where not used; a STANDING frame has none
    arrival   (n,) ns
    counter   (n,) of the end-to-end protection
    """

    count: IntArray
    intervals: IntArray
    arrival: IntArray
    counter: IntArray
    modulo: int

    def select(self, keep: npt.NDArray[np.bool_]) -> "ToothFrames":
        """The frames where `keep`, shape (n,), is True."""
        return ToothFrames(
            self.count[keep],
            self.intervals[keep],
            self.arrival[keep],
            self.counter[keep],
            self.modulo,
        )


@dataclass(frozen=True)
class Anchors:
    """Absolute time of single teeth.

    count    (n,) running count, modulo `modulo` (None: unwrapped)
    time     (n,) us, encoder's clock, unwrapped
    arrival  (n,) ns
    """

    count: IntArray
    time: IntArray
    arrival: IntArray
    modulo: int | None = None


def tooth_frames(frames: Frames, time_ns: IntArray) -> ToothFrames:
    """Fields of n tooth frames. time_ns: arrival of each frame of the log, ns."""
    layout = frames.samples("layout").raw
    by_layout = {
        kind: sorted(
            (each for each in frames.message.signals if kind in each.multiplexer_ids),
            key=lambda signal: signal.first_bit,
        )
        for kind in Intervals
        if kind is not Intervals.STANDING
    }
    intervals = np.zeros((len(frames), max(map(len, by_layout.values()))), np.int64)
    for kind, signals in by_layout.items():
        for column, signal in enumerate(signals):
            intervals[layout == kind, column] = frames.samples(signal.name).raw
    return ToothFrames(
        np.asarray(frames.samples("tooth_count").raw, np.int64),
        intervals,
        time_ns[frames.rows],
        np.asarray(frames.samples("counter").raw, np.int64),
        1 << frames.message.signal("tooth_count").length,
    )


def tooth_anchors(frames: Frames, time_ns: IntArray) -> Anchors:
    """Fields of encoder status frames, valid CRC only. time_ns: arrival of each frame of the log, ns."""
    good = frames.select(frames.protected)
    arrival = time_ns[good.rows]
    count, time = good.samples("tooth_count"), good.samples("tooth_time")
    return Anchors(
        np.asarray(count.raw, np.int64),
        unwrap_clock(
            np.asarray(time.raw, np.int64), 1 << time.signal.length, arrival // MICROSECOND
        ),
        arrival,
        1 << count.signal.length,
    )
