"""Samples of one role from the frames of a log, in SI, with their arrival times."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slipbench.protocol.codec.unwrap import unwrap_clock
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.decode import Frames, Samples, SortedLog
from slipbench.protocol.recording.channel import FloatArray
from slipbench.protocol.recording.role_lookup import (
    find_message,
    find_signal,
    find_signals,
    meanings,
    to_si,
)
from slipbench.protocol.recording.role_map import Source
from slipbench.protocol.recording.sender_check import TWO_SENDERS, interleaved, repeated
from slipbench.protocol.recording.teeth import Teeth, teeth
from slipbench.protocol.units import linear

Rows = npt.NDArray[np.intp]
IntArray = npt.NDArray[np.int64]


@dataclass(frozen=True)
class BusSamples:
    """n samples of one role.

    arrival  (n,) s since the recording's start
    value    (n,) in the role's unit
    device   (n,) s on the sender's own clock; None where it sends no time
    turn     s after which that clock wraps on the wire; None where `device` is unwrapped or None
    """

    arrival: FloatArray
    value: FloatArray
    origin: str
    device: FloatArray | None = None
    turn: float | None = None


class Missing(Exception):  # noqa: N818 - not an error: the log has nothing of this role
    """A role has no samples; the text states the reason."""


@dataclass(frozen=True)
class BusLog:
    """A log sorted by message. start_ns: time zero of the recording, ns since the log's epoch."""

    sorted_log: SortedLog
    database: Database
    start_ns: int

    def samples(self, role: str, source: Source, unit: str) -> BusSamples:
        """Samples of a role in `unit`.

        Raises InputError where the role map does not suit the database, and Missing where the log
        has no samples of the role.
        """
        if source.teeth:
            return self._teeth(source)
        message, signals = find_signals(self.database, role, source)
        frames = self.frames(message, role, source)
        rows, value = _mean(frames, signals, role, source, unit)
        if source.valid:
            rows, value = _only_valid(frames, source.valid, rows, value, role)
        if not rows.size:
            raise Missing(f"no frame of {message.name} holds valid samples of it")
        device, turn = self._device(frames, rows, source)
        origin = f"{self._bus_name(frames)} {message.name}." + "+".join(s.name for s in signals)
        return BusSamples(self._arrival(rows), value, origin, device, turn)

    def frames(self, message: Message, role: str, source: Source) -> Frames:
        """Valid frames of a message on one bus: correct CRC, not repeated.

        Raises Missing where there are none or where two senders alternate, and InputError where
        the role map names no bus and the message came on several.
        """
        frames = self._of_bus(self.sorted_log.frames[message.name], role, source)
        if not len(frames):
            raise Missing(self._why_none(message, source))
        good = frames.select(frames.protected)
        if not len(good):
            raise Missing(f"all {len(frames)} frames of {message.name} have a wrong CRC")
        if interleaved(good):
            raise Missing(f"{TWO_SENDERS}: the counters of {message.name} interleave")
        return good.select(~repeated(good))

    def _of_bus(self, frames: Frames, role: str, source: Source) -> Frames:
        log = self.sorted_log.log
        found = np.unique(log.bus[frames.rows])
        if source.bus:
            selected = [n for n in found if log.buses[n] == source.bus]
            return frames.select(np.isin(log.bus[frames.rows], selected))
        if found.size > 1:
            names = ", ".join(log.buses[number] for number in found)
            raise InputError(
                f"{frames.message.name} ({frames.message.identifier:#05x}) came on several buses",
                where=f"role {role}",
                expected="one bus",
                found=names,
                remedy=f'name the bus in the role map: bus = "{log.buses[found[0]]}"',
            )
        return frames

    def _why_none(self, message: Message, source: Source) -> str:
        name = f"{message.name} ({message.identifier:#05x})"
        short = self.sorted_log.short.get(message.name)
        if short is not None:
            longest = int(self.sorted_log.log.length[short].max())
            return f"all {short.size} frames of {name} are too short: {longest} of {message.length}"
        buses = ", ".join(self.sorted_log.log.buses)
        bus = source.bus or message.bus
        if bus and bus not in self.sorted_log.log.buses:
            return f"no frame of {name} came on {bus}; the log has {buses or 'no bus'}"
        return f"no frame of {name} came on {bus or buses or 'any bus'}"

    def _arrival(self, rows: Rows) -> FloatArray:
        return _seconds(self.sorted_log.log.time_ns[rows] - self.start_ns)

    def _bus_name(self, frames: Frames) -> str:
        return self.sorted_log.log.buses[int(self.sorted_log.log.bus[frames.rows[0]])]

    def _device(
        self, frames: Frames, rows: Rows, source: Source
    ) -> tuple[FloatArray | None, float | None]:
        """Sender's own clock at the frames `rows`, unwrapped, and its period of wrapping; both s."""
        if not source.time_signal:
            return None, None
        signal = find_signal(frames.message, source.time_signal)
        tick = signal.scale * linear(signal.unit, "s")[0]
        stamps = frames.samples(signal.name)
        raw = stamps.raw[np.searchsorted(stamps.rows, rows)].astype(np.int64)
        waited = np.rint(self._arrival(rows) / tick).astype(np.int64)
        modulo = 1 << signal.length
        return unwrap_clock(raw, modulo, waited) * np.float64(tick), modulo * tick

    def _teeth(self, source: Source) -> BusSamples:
        """Time and running count of every tooth of one encoder."""
        message, status = (
            find_message(self.database, name) for name in (source.teeth, source.anchor)
        )
        frames = self._of_bus(self.sorted_log.frames[message.name], source.teeth, source)
        if not len(frames):
            raise Missing(self._why_none(message, source))
        anchors = self._of_bus(self.sorted_log.frames[status.name], source.anchor, source)
        found = teeth(
            frames, anchors, self.sorted_log.log.time_ns, source.names, source.anchor_names
        )
        if not found.count.size:
            raise Missing(f"no tooth in the {len(frames)} frames of {message.name}")
        return self._as_samples(found, f"{self._bus_name(frames)} {message.name}")

    def _as_samples(self, found: Teeth, origin: str) -> BusSamples:
        arrival = _seconds(found.arrival_ns - self.start_ns)
        count = found.count.astype(np.float64)
        if not found.anchored.any():
            origin += " (times from arrivals: the encoder's status never came)"
            return BusSamples(_seconds(found.time_us * 1000 - self.start_ns), count, origin)
        return BusSamples(arrival, count, origin, found.time)


def _seconds(time_ns: IntArray) -> FloatArray:
    return time_ns * np.float64(1e-9)


def _mean(
    frames: Frames, signals: list[Signal], role: str, source: Source, unit: str
) -> tuple[Rows, FloatArray]:
    """Mean of the signals in `unit` over the frames that hold them all."""
    parts = [_known(frames.samples(signal.name), source) for signal in signals]
    if source.values:
        return _meant(parts[0], meanings(role, source, "role map"))
    rows = parts[0].rows
    for part in parts[1:]:
        rows = np.intersect1d(rows, part.rows, assume_unique=True)
    values = [
        to_si(part.value[np.searchsorted(part.rows, rows)], signal.unit, role, source, unit)
        for part, signal in zip(parts, signals, strict=True)
    ]
    return rows, np.mean(values, axis=0) if len(values) > 1 else values[0]


def _meant(samples: Samples, meaning: Mapping[int, int]) -> tuple[Rows, FloatArray]:
    """Values of an enumeration as the role map gives them; raw values without one are not known."""
    raw, value = np.array(sorted(meaning.items()), np.int64).T
    at = np.searchsorted(raw, samples.raw).clip(max=raw.size - 1)
    keep = raw[at] == samples.raw
    return samples.rows[keep], value[at[keep]].astype(np.float64)


def _known(samples: Samples, source: Source) -> Samples:
    """Samples without the values that mean "not known"."""
    if not source.unknown:
        return samples
    signal = samples.signal
    step = 1e-6 * np.abs(source.unknown) if signal.is_float else 0.5 * abs(signal.scale)
    away = np.abs(samples.value[:, None] - np.asarray(source.unknown))
    keep = (away > step).all(axis=1)
    return Samples(samples.signal, samples.rows[keep], samples.raw[keep])


def _only_valid(
    frames: Frames, valid: str, rows: Rows, value: FloatArray, role: str
) -> tuple[Rows, FloatArray]:
    flag = frames.samples(find_signal(frames.message, valid).name)
    keep = np.isin(rows, flag.rows[flag.raw != 0])
    if not keep.any():
        raise Missing(f"{valid} never says that {role} is valid")
    return rows[keep], value[keep]
