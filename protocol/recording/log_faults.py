"""Faulty frames of a log, counted by message and fault."""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.faults import Fault
from slipbench.protocol.database.layout import Message, Signal
from slipbench.protocol.logs.decode import Frames, SortedLog
from slipbench.protocol.recording.recording import BusFault

SILENCE = 10  # periods after which a cyclic, protected message counts as stale
EVENT = "GenMsgSendType"


def log_faults(sorted_log: SortedLog) -> tuple[BusFault, ...]:
    """Faults of a log with their counts.

    unknown identifier  frames that the database does not know, by identifier ("0x123")
    too short           frames shorter than their message
    wrong CRC           of protected messages; no other fault is looked for in such a frame
    lost, repeated      by their counters; as many lost in a row as a counter has values are invisible
    stale               silences longer than `SILENCE` periods (not of event messages)
    out of range        frames in which a signal of a protected message leaves its declared range
    """
    return tuple(_faults(sorted_log))


def _faults(sorted_log: SortedLog) -> Iterator[BusFault]:
    time_ns = sorted_log.log.time_ns
    start = int(time_ns[0]) if time_ns.size else 0

    def fault_of(message: str, fault: Fault, rows: npt.NDArray[np.intp], count: int) -> BusFault:
        return BusFault(message, str(fault), count, (int(time_ns[rows[0]]) - start) * 1e-9)

    identifiers = sorted_log.log.identifier[sorted_log.unknown]
    for identifier in sorted_log.unknown_identifiers():
        rows = sorted_log.unknown[identifiers == identifier]
        yield fault_of(f"{identifier:#x}", Fault.UNKNOWN, rows, rows.size)
    for name, rows in sorted_log.short.items():
        yield fault_of(name, Fault.SHORT, rows, rows.size)
    for name, frames in sorted_log.frames.items():
        for fault, rows, count in _of_message(frames, time_ns):
            if count:
                yield fault_of(name, fault, rows, count)


def _of_message(
    frames: Frames, time_ns: npt.NDArray[np.int64]
) -> Iterator[tuple[Fault, npt.NDArray[np.intp], int]]:
    if frames.message.protection is None:
        return
    wrong = frames.rows[~frames.protected]
    yield Fault.CRC, wrong, wrong.size
    good = frames.select(frames.protected)
    if good.counter_period:
        lost = e2e.losses(good.counters, good.counter_period)
        yield Fault.LOST, good.rows[lost > 0], int(lost[lost > 0].sum())
        yield Fault.REPEATED, good.rows[lost < 0], int(np.count_nonzero(lost < 0))
    stale = good.rows[_silences(good, time_ns)]
    yield Fault.STALE, stale, stale.size
    outside = _outside(good)
    yield Fault.RANGE, outside, outside.size


def _silences(frames: Frames, time_ns: npt.NDArray[np.int64]) -> npt.NDArray[np.bool_]:
    period = _period(frames.message)
    waited = np.diff(time_ns[frames.rows], prepend=time_ns[frames.rows[:1]])
    return np.asarray(waited * 1e-9 > SILENCE * period)


def _period(message: Message) -> float:
    """Time between frames of a cyclic message, s; infinite for one sent on events."""
    event = message.attributes.get(EVENT) == 1
    return np.inf if event or message.cycle_time is None else message.cycle_time


def _outside(frames: Frames) -> npt.NDArray[np.intp]:
    """Rows of frames in which some signal leaves its range, ascending."""
    found = [_leaves(frames, signal) for signal in frames.message.signals]
    return np.unique(np.concatenate([*found, np.zeros(0, np.intp)]))


def _leaves(frames: Frames, signal: Signal) -> npt.NDArray[np.intp]:
    samples = frames.samples(signal.name)
    half = abs(signal.scale) / 2  # the last step may round past the limit
    low = -np.inf if signal.minimum is None else signal.minimum - half
    high = np.inf if signal.maximum is None else signal.maximum + half
    return samples.rows[(samples.value < low) | (samples.value > high)]
