"""Fields of the encoders' frames as columns."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec.messages import Intervals
from slipbench.protocol.codec.unwrap import unwrap_clock
from slipbench.protocol.logs.decode import Frames, Samples
from slipbench.protocol.units import linear

IntArray = npt.NDArray[np.int64]
MICROSECOND = 1_000  # ns
OWN_NAMES: Mapping[str, str] = {}  # the signals have the names of the fields


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


def tooth_frames(
    frames: Frames, time_ns: IntArray, names: Mapping[str, str] = OWN_NAMES
) -> ToothFrames:
    """Fields of n tooth frames. time_ns: arrival of each frame of the log, ns; names: of the signals."""
    multiplexer, counted = (names.get(key, key) for key in ("layout", "tooth_count"))
    layout = frames.samples(multiplexer).raw
    by_layout = {
        kind: sorted(
            (
                each
                for each in frames.message.signals
                if each.multiplexer == multiplexer and kind in each.multiplexer_ids
            ),
            key=lambda signal: signal.first_bit,
        )
        for kind in Intervals
        if kind is not Intervals.STANDING
    }
    intervals = np.zeros((len(frames), max(map(len, by_layout.values()))), np.int64)
    for kind, signals in by_layout.items():
        for column, signal in enumerate(signals):
            intervals[layout == kind, column] = _microseconds(frames.samples(signal.name))
    return ToothFrames(
        np.asarray(frames.samples(counted).raw, np.int64),
        intervals,
        time_ns[frames.rows],
        frames.counters,
        1 << frames.message.signal(counted).length,
    )


def tooth_anchors(
    frames: Frames, time_ns: IntArray, names: Mapping[str, str] = OWN_NAMES
) -> Anchors:
    """Fields of encoder status frames, valid CRC only. time_ns: arrival of each frame of the log, ns."""
    good = frames.select(frames.protected)
    arrival = time_ns[good.rows]
    count, time = (good.samples(names.get(key, key)) for key in ("tooth_count", "tooth_time"))
    tick = time.signal.scale * linear(time.signal.unit, "us")[0]  # us
    waited = np.rint(arrival / (tick * MICROSECOND)).astype(np.int64)
    ticks = unwrap_clock(np.asarray(time.raw, np.int64), 1 << time.signal.length, waited)
    return Anchors(
        np.asarray(count.raw, np.int64),
        ticks if tick == 1 else np.rint(ticks * tick).astype(np.int64),
        arrival,
        1 << count.signal.length,
    )


def _microseconds(samples: Samples) -> IntArray:
    """Whole us of a signal that holds a time."""
    signal = samples.signal
    tick = signal.scale * linear(signal.unit, "us")[0]
    raw = np.asarray(samples.raw, np.int64)
    return raw if tick == 1 else np.rint(raw * tick).astype(np.int64)
