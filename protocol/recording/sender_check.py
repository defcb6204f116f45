"""Find messages with two senders: counters that interleave, or two alternating time series."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec.e2e import PERIOD
from slipbench.protocol.logs.decode import Frames, SortedLog
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.recording.recording import BusFault

TWO_SENDERS = "two senders"
_FEWEST = 50  # samples from which two time series can be separated
_ALTERNATES = 5.0  # times as far from the sample before as from the one before that


def counters(frames: Frames) -> npt.NDArray[np.int64]:
    """Counter of the end-to-end protection of every frame, (n,)."""
    return np.asarray(frames.samples("counter").raw, np.int64)


def repeated(frames: Frames) -> npt.NDArray[np.bool_]:
    """Find frames whose counter is that of the frame before, (n,); none without protection."""
    same = np.zeros(len(frames), np.bool_)
    if frames.message.protection is not None:
        same[1:] = np.diff(counters(frames)) % PERIOD == 0
    return same


def interleaved(frames: Frames) -> bool:
    """Tell two counts that alternate from one: every second frame is the next of its own."""
    if frames.message.protection is None or len(frames) < PERIOD:
        return False
    counter = counters(frames)
    own = (counter[2:] - counter[:-2]) % PERIOD == 1
    return bool(np.mean(own) > 0.6 and np.mean(np.diff(counter) % PERIOD == 1) < 0.6)


def interleaved_messages(sorted_log: SortedLog, start_ns: int) -> Iterator[BusFault]:
    """Find the protected messages whose counters interleave on one bus."""
    for name, frames in sorted_log.frames.items():
        bus = sorted_log.log.bus[frames.rows]
        for number in np.unique(bus):
            one = frames.select(bus == number)
            if interleaved(one.select(one.protected)):
                first = (int(sorted_log.log.time_ns[one.rows[0]]) - start_ns) * 1e-9
                yield BusFault(name, TWO_SENDERS, len(one), first)


def alternates(value: FloatArray) -> bool:
    """Whether two time series alternate: each sample is near the last but one, not the last.

    For messages without a counter. Signals of few levels (a gear, a switch) are not judged.
    """
    if value.size < _FEWEST or np.unique(value[:1000]).size < 5:
        return False
    near, far = np.abs(np.diff(value)), np.abs(value[2:] - value[:-2])
    return bool(np.median(near) > _ALTERNATES * max(np.percentile(far, 75), 1e-9))
