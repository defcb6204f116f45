"""Find messages with two senders: counters that interleave, or two alternating time series."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from slipbench.protocol.logs.decode import Frames, SortedLog
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.recording.recording import BusFault

TWO_SENDERS = "two senders"
_FEWEST = 50  # samples from which two time series can be separated
_FEWEST_COUNTS = 15  # frames from which two counters can be separated
_ALTERNATES = 5.0  # times as far from the sample before as from the one before that


def repeated(frames: Frames) -> npt.NDArray[np.bool_]:
    """Whether each frame's counter equals that of the frame before, (n,); False without counter."""
    same = np.zeros(len(frames), np.bool_)
    if frames.counter_period:
        same[1:] = np.diff(frames.counters) % frames.counter_period == 0
    return same


def interleaved(frames: Frames) -> bool:
    """Whether two counters alternate: every second frame continues the count of its own sender."""
    period = frames.counter_period
    if not period or len(frames) < max(period, _FEWEST_COUNTS):
        return False
    counter = frames.counters
    own = (counter[2:] - counter[:-2]) % period == 1
    return bool(np.mean(own) > 0.6 and np.mean(np.diff(counter) % period == 1) < 0.6)


def interleaved_messages(sorted_log: SortedLog, start_ns: int) -> Iterator[BusFault]:
    """A fault for each protected message whose counters interleave on one bus. start_ns: ns."""
    for name, frames in sorted_log.frames.items():
        bus = sorted_log.log.bus[frames.rows]
        for number in np.unique(bus):
            one = frames.select(bus == number)
            if interleaved(one.select(one.protected)):
                first = (int(sorted_log.log.time_ns[one.rows[0]]) - start_ns) * 1e-9
                yield BusFault(name, TWO_SENDERS, len(one), first)


def alternates(value: FloatArray) -> bool:
    """Whether two time series alternate: each sample is near the last but one, not the last.

    value: samples of one signal in their order, shape (n,), any unit. For messages without
    a counter. Signals of few levels (a gear, a switch) are not judged.
    """
    if value.size < _FEWEST or np.unique(value[:1000]).size < 5:
        return False
    near, far = np.abs(np.diff(value)), np.abs(value[2:] - value[:-2])
    return bool(np.median(near) > _ALTERNATES * max(np.percentile(far, 75), 1e-9))
