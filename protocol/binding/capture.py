"""Cycle time, counter and checksum of each message of a capture; each signal as a time series."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from slipbench.protocol.binding.protection_search import (
    SHARE,
    Counter,
    Profile,
    counter_of,
    find_checksum,
    find_profile,
)
from slipbench.protocol.binding.words import concepts_in
from slipbench.protocol.database.layout import Checksum, Database, Message, Signal
from slipbench.protocol.logs import Progress, quiet, read_log
from slipbench.protocol.logs.decode import Frames, SortedLog, sort_log

Array = npt.NDArray[np.float64]

FEWEST = 5  # frames from which a cycle time is stated
JITTER = 0.7  # of an interval, relative to the cycle time
CYCLIC = 0.85  # share of the intervals within that jitter from which a message is cyclic


@dataclass(frozen=True)
class Traffic:
    """One message in a capture.

    cycle_time  s, mean of the intervals without gaps; None where it is not cyclic
    protection  found in the payloads, with the share of the frames that it explains
    counter     name of a counter signal; period: number of its values
    checksum    one byte over the others, with its signal; others: rules that explain it as well
    notes       what was found in bytes for which the database has no signal
    contradicted  the protection that the database states does not hold
    """

    frames: int
    cycle_time: float | None
    longest: float
    profile: Profile | None = None
    counter: str = ""
    period: int = 0
    checksum: Checksum | None = None
    share: float = 1.0
    others: tuple[Checksum, ...] = ()
    notes: tuple[str, ...] = ()
    contradicted: bool = False


@dataclass(frozen=True)
class Captured:
    """A capture, decoded with a database."""

    database: Database
    log: SortedLog
    origin: str = ""
    traffic: Mapping[str, Traffic] = field(default_factory=dict)

    @property
    def start_ns(self) -> int:
        """Time of the first frame, ns."""
        return int(self.log.log.time_ns[0]) if len(self.log.log) else 0

    @cached_property
    def duration(self) -> float:
        """Time from the first frame to the last, s."""
        times = self.log.log.time_ns
        return float(times[-1] - times[0]) * 1e-9 if times.size else 0.0

    def series(self, message: Message, signal: Signal) -> tuple[Array, Array]:
        """Times (s since the first frame) and values (in the database's unit) of a signal, (n,) each."""
        samples = self.log.frames[message.name].samples(signal.name)
        since = self.log.log.time_ns[samples.rows] - self.start_ns
        return np.asarray(since * 1e-9, np.float64), np.asarray(samples.value, np.float64)


def read_capture(path: Path, database: Database, progress: Progress = quiet) -> Captured:
    """Capture of a log in any format that is known. Raises InputError where it cannot be read."""
    return captured(sort_log(read_log(path, progress).frames, database), database, str(path))


def captured(log: SortedLog, database: Database, origin: str = "") -> Captured:
    """Capture of a sorted log, every message measured."""
    traffic = {
        name: traffic_of(frames, log.log.time_ns)
        for name, frames in log.frames.items()
        if len(frames)
    }
    return Captured(database, log, origin, traffic)


def traffic_of(frames: Frames, time_ns: npt.NDArray[np.int64]) -> Traffic:
    """Cycle time, counter and checksum of one message. time_ns: (n,) of the whole log, ns."""
    intervals = np.diff(time_ns[frames.rows]) * 1e-9
    traffic = Traffic(
        len(frames),
        _cycle_time(intervals),
        float(intervals.max()) if intervals.size else np.inf,
        contradicted=float(frames.protected.mean()) < SHARE,
    )
    profile = find_profile(frames.data)
    return replace(traffic, profile=profile) if profile else _plain(traffic, frames)


def _plain(traffic: Traffic, frames: Frames) -> Traffic:
    """Counter and checksum that are no AUTOSAR profile."""
    message, data = frames.message, frames.data
    counter, count = _counter(frames)
    notes = [] if counter else list(_free_counters(message, data))
    if count is not None and count.step > 1:
        notes.append(
            f"{counter} counts modulo {count.period} by {count.step} from frame to frame: the"
        )
        notes.append("  capture lacks frames, or it is no counter of frames; not proposed")
        counter, count = "", None
    places = _places(message)
    check = find_checksum(data, (*places, *_free_bytes(message)))
    traffic = replace(traffic, counter=counter, period=count.period if count else 0)
    if check is not None and check.place not in places:
        named = describe(check.rule)
        notes.append(f"byte {check.place} is a checksum ({named}), but has no signal of its own")
    elif check is not None:
        rule = _named(check.rule, places[check.place])
        others = tuple(_named(each, rule.signal) for each in check.others)
        traffic = replace(traffic, checksum=rule, share=check.share, others=others)
    return replace(traffic, notes=tuple(notes))


def describe(rule: Checksum) -> str:
    """A checksum rule in words."""
    if rule.kind != "crc8":
        return {"xor": "XOR", "sum": "sum"}[rule.kind]
    return f"CRC-8, polynomial 0x{rule.polynomial:02X}"


def _named(rule: Checksum, signal: str) -> Checksum:
    return Checksum(signal, rule.kind, rule.polynomial, rule.start, rule.final_xor)


def _cycle_time(intervals: Array) -> float | None:
    """Mean interval, s, of a message that is sent in cycles. intervals: s, (n,)."""
    if intervals.size < FEWEST:
        return None
    usual = intervals[intervals <= 2.5 * np.median(intervals)]  # without gaps
    cycle = float(usual.mean())
    inside = np.abs(intervals - cycle) <= JITTER * cycle
    return cycle if cycle > 0 and inside.mean() >= CYCLIC else None


def _counter(frames: Frames) -> tuple[str, Counter | None]:
    """Signal that counts from frame to frame; the one named so first."""
    candidates = sorted(
        (signal for signal in frames.message.signals if _may_count(signal)),
        key=lambda signal: (not _called_counter(signal), _called_checksum(signal)),
    )
    for signal in candidates:
        raw = frames.samples(signal.name).raw.astype(np.int64)
        found = counter_of(raw, signal.length)
        if found is not None and _wrapped(raw, signal):
            return signal.name, found
    return "", None


def _may_count(signal: Signal) -> bool:
    plain = not (signal.signed or signal.is_float or signal.multiplexer)
    return plain and 2 <= signal.length <= 16 and signal.unit not in ("s", "ms", "us")


def _called_counter(signal: Signal) -> bool:
    return not concepts_in(signal.name).isdisjoint(("count", "protection"))


def _wrapped(raw: npt.NDArray[np.int64], signal: Signal) -> bool:
    """Whether a count is that of a counter: it wraps, or its name states it."""
    return bool(np.any(np.diff(raw) < 0)) or _called_counter(signal)


def _places(message: Message) -> dict[int, str]:
    """Whole bytes that have a signal of their own without a unit; those called checksums first."""
    byte_signals = {
        signal.first_bit // 8: signal
        for signal in message.signals
        if signal.length == 8
        and signal.first_bit % 8 == 0
        and not (signal.signed or signal.unit or signal.multiplexer)
    }
    ends = (message.length - 1, 0)
    order = sorted(
        byte_signals, key=lambda at: (not _called_checksum(byte_signals[at]), at not in ends, -at)
    )
    return {place: byte_signals[place].name for place in order}


def _called_checksum(signal: Signal) -> bool:
    return "protection" in concepts_in(signal.name)


def _free_bytes(message: Message) -> list[int]:
    """Bytes in which no signal lies, the last first."""
    taken = {bit // 8 for signal in message.signals for bit in _bits(signal)}
    return [byte for byte in reversed(range(message.length)) if byte not in taken]


def _bits(signal: Signal) -> Iterator[int]:
    """Bits of a signal: byte number times 8 plus a position in that byte."""
    yield from range(signal.first_bit, signal.first_bit + signal.length)


def _free_counters(message: Message, data: npt.NDArray[np.uint8]) -> Iterator[str]:
    """Counters in bytes that have no signal."""
    for place in _free_bytes(message):
        for half, values in (("low", data[:, place] & 0x0F), ("high", data[:, place] >> 4)):
            raw = values.astype(np.int64)
            found = counter_of(raw, 4)
            if found is not None and found.step == 1:
                yield f"the {half} half of byte {place} counts, but has no signal"
