"""Decode a whole log at once: frames sorted by message, then each signal as a column."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec import extract
from slipbench.protocol.codec.protection import guard_of
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.logs.frame_log import FrameLog

Rows = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Samples:
    """One signal of a log: m samples.

    rows   (m,) rows of the frames in the log
    raw    (m,) as sent: int64, uint64 (unsigned, 64 bits) or float64
    value  (m,) in the database's unit, raw * scale + offset (whole numbers stay whole)
    """

    signal: Signal
    rows: Rows
    raw: extract.Raw

    @cached_property
    def value(self) -> npt.NDArray[Any]:
        """Physical values in the database's unit, shape (m,)."""
        return extract.physical(self.signal, self.raw)

    @cached_property
    def exact(self) -> npt.NDArray[Any]:
        """Physical values, (m,), no whole number rounded.

        As `value`, but Python integers (dtype object) where a whole scale and offset lead beyond
        64 bits.
        """
        scale, offset = float(self.signal.scale), float(self.signal.offset)
        integral = not self.signal.is_float and scale.is_integer() and offset.is_integer()
        if not integral or self.value.dtype != np.float64:
            return self.value
        wide = [raw * int(scale) + int(offset) for raw in self.raw.tolist()]
        return np.array(wide, dtype=object)

    def names(self) -> list[str | None]:
        """Name of each raw value in the value table; None where it has none."""
        return [self.signal.choices.get(value) for value in self.raw.tolist()]


@dataclass(frozen=True)
class Frames:
    """All frames of one message that are long enough for it.

    rows   (n,) rows in the log, ascending
    words  (n, m) payloads as words of 8 bytes, byte 0 lowest
    """

    message: Message
    rows: Rows
    words: extract.Words

    def __len__(self) -> int:
        """Count the frames."""
        return int(self.rows.size)

    def select(self, keep: npt.NDArray[np.bool_]) -> "Frames":
        """The frames where `keep`, shape (n,), is True."""
        return Frames(self.message, self.rows[keep], self.words[keep])

    def samples(self, name: str) -> Samples:
        """Samples of one signal; of a multiplexed one, from the frames that hold it."""
        return _samples(self.message.signal(name), self)

    def page(self, multiplexer: str, values: tuple[int, ...]) -> "Frames":
        """The frames in which `multiplexer` has one of `values`; kept for the next call."""
        key = multiplexer, values
        if key not in self._pages:
            parent = self.samples(multiplexer)
            present = _among(parent.raw, values)
            in_all = parent.rows.size == self.rows.size  # unless multiplexed itself
            within = (
                np.flatnonzero(present)
                if in_all
                else (np.searchsorted(self.rows, parent.rows[present]))
            )
            self._pages[key] = Frames(self.message, self.rows[within], self.words[within])
        return self._pages[key]

    @cached_property
    def _pages(self) -> dict[tuple[str, tuple[int, ...]], "Frames"]:
        return {}

    @cached_property
    def protected(self) -> npt.NDArray[np.bool_]:
        """Whether each frame's CRC is correct, (n,); all True where the message has none."""
        guard = guard_of(self.message)
        return np.ones(len(self), np.bool_) if guard is None else guard.all_intact(self.data)

    @property
    def data(self) -> npt.NDArray[np.uint8]:
        """Payloads, (n, length)."""
        return self.words.view(np.uint8)[:, : self.message.length]

    @cached_property
    def counters(self) -> npt.NDArray[np.int64]:
        """Counter of each frame's protection, (n,); 0 where the message has none."""
        guard = guard_of(self.message)
        return np.zeros(len(self), np.int64) if guard is None else guard.counters(self.data)

    @cached_property
    def counter_period(self) -> int:
        """Number of values of the counter of the protection; 0 where the message has none."""
        guard = guard_of(self.message)
        return guard.period if guard else 0


@dataclass(frozen=True)
class SortedLog:
    """A log sorted by message.

    frames   by message name; a message that never came has 0 frames
    short    rows of frames shorter than their message, by message name; never decoded
    unknown  rows of frames that the database does not know
    """

    log: FrameLog
    frames: Mapping[str, Frames]
    short: Mapping[str, Rows]
    unknown: Rows

    def unknown_identifiers(self) -> Mapping[int, int]:
        """Number of frames by identifier, for identifiers that the database lacks."""
        found, counts = np.unique(self.log.identifier[self.unknown], return_counts=True)
        return dict(zip(found.tolist(), counts.tolist(), strict=True))


def sort_log(log: FrameLog, database: Database) -> SortedLog:
    """Frames of a log by message; a message that has a bus comes on this bus only.

    Frames of all buses are mixed for a message without a bus: select one bus before.
    """
    messages = database.messages
    number = _numbers(log, database)
    short = log.length < _lengths(messages)[number]
    sort_key = np.where(short, len(messages) + 1 + number, number) if short.any() else number
    order = np.argsort(sort_key, kind="stable")
    ends = np.cumsum(np.bincount(sort_key, minlength=2 * len(messages) + 1))
    pieces = np.split(order, ends[:-1])
    payloads = extract.words(log.data)
    frames = [_frames(m, rows, payloads) for m, rows in zip(messages, pieces, strict=False)]
    return SortedLog(
        log,
        frames={each.message.name: each for each in frames},
        short={
            message.name: rows
            for message, rows in zip(messages, pieces[len(messages) + 1 :], strict=False)
            if rows.size
        },
        unknown=pieces[len(messages)],
    )


def decode(sorted_log: SortedLog) -> Mapping[str, Mapping[str, Samples]]:
    """Samples of every signal, by message name and signal name."""
    return {
        name: {signal.name: frames.samples(signal.name) for signal in frames.message.signals}
        for name, frames in sorted_log.frames.items()
    }


def _frames(message: Message, rows: Rows, payloads: extract.Words) -> Frames:
    needed = -(-message.length // 8)
    if not rows.size:  # a log of short payloads may have fewer words than the message needs
        return Frames(message, rows, np.zeros((0, needed), np.uint64))
    return Frames(message, rows, payloads[:, :needed].take(rows, axis=0))


def _lengths(messages: tuple[Message, ...]) -> npt.NDArray[np.uint8]:
    return np.array([*(message.length for message in messages), 0], np.uint8)


def _numbers(log: FrameLog, database: Database) -> npt.NDArray[Any]:
    """Number of each frame's message in the database, its length where unknown."""
    if not any(message.bus for message in database.messages):
        return _numbers_on(log.identifier, log.extended, database, "")
    numbers = np.full(len(log), len(database.messages), np.uint16)
    for index, bus in enumerate(log.buses):
        on = log.bus == index
        numbers[on] = _numbers_on(log.identifier[on], log.extended[on], database, bus)
    return numbers


def _numbers_on(
    identifier: npt.NDArray[np.uint32],
    extended: npt.NDArray[np.bool_],
    database: Database,
    bus: str,
) -> npt.NDArray[Any]:
    """Number of each frame's message, if it came on `bus`."""
    unknown = len(database.messages)
    kind = np.uint8 if 2 * unknown + 1 < 256 else np.uint16
    table = np.full(2049, unknown, kind)
    wide: dict[int, int] = {}
    for number, message in enumerate(database.messages):
        if message.bus not in ("", bus):
            continue
        if message.extended:
            wide[message.identifier] = number
        else:
            table[message.identifier] = number
    numbers = table[np.minimum(identifier, 2048)]
    if extended.any():
        numbers[extended] = _wide(identifier[extended], wide, unknown)
    return numbers


def _wide(
    identifiers: npt.NDArray[np.uint32], numbers: Mapping[int, int], unknown: int
) -> npt.NDArray[Any]:
    known = np.array([*sorted(numbers), 1 << 29], np.int64)
    values = np.array([*(numbers[key] for key in sorted(numbers)), unknown], np.int64)
    place = np.searchsorted(known, identifiers)
    return np.where(known[place] == identifiers, values[place], unknown)


def _samples(signal: Signal, frames: Frames) -> Samples:
    if signal.multiplexer is not None:
        frames = frames.page(signal.multiplexer, signal.multiplexer_ids)
    return Samples(signal, frames.rows, extract.raw(signal, frames.words))


def _among(raw: extract.Raw, values: tuple[int, ...]) -> npt.NDArray[np.bool_]:
    if len(values) == 1 and raw.dtype == np.int64:
        return np.asarray(raw == values[0])
    return np.isin(raw, values)
