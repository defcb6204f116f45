"""Edits of a captured drive: frames dropped, delayed, or with another value of a signal.

    edited(log, database, [
        Drop("OpticalSpeed", begin=2.0, end=2.5),
        Delay("EngineStatus", by=0.020),
        Alter("EngineStatus.engine_speed", lambda time, value: value + 500, begin=3.0),
    ])

Times are s since the first frame of the log. An altered frame keeps its counter and has a correct CRC.
With `repair`, the counters of the message count on over what was dropped, so that a receiver cannot
detect it; without, a receiver detects lost frames.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np
import numpy.typing as npt

from slipbench.bench.bus.frame_content import counter_in, protect, raw_of, value_in, with_raw
from slipbench.protocol.codec import e2e
from slipbench.protocol.database.layout import Database, Message
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.frame_log import FrameLog

Rows = npt.NDArray[np.intp]
Times = npt.NDArray[np.float64]
Change = Callable[[float, float], float]  # (time in s, value) -> value, in the database's unit


@dataclass(frozen=True)
class Drop:
    """Frames of a message that are not sent. begin, end: s; repair: counters count on."""

    message: str
    begin: float = 0.0
    end: float = inf
    repair: bool = False

    def __str__(self) -> str:
        return f"{self.message} dropped"


@dataclass(frozen=True)
class Delay:
    """Frames of a message that are sent later by `by` s, in their order. begin, end: s."""

    message: str
    by: float
    begin: float = 0.0
    end: float = inf

    def __str__(self) -> str:
        return f"{self.message} delayed by {self.by * 1e3:g} ms"


@dataclass(frozen=True)
class Alter:
    """Signal "Message.signal" with another value: a number, or `value(time, value)`.

    begin, end  s
    repair      the CRC is computed anew; without, it is that of the frame before
    """

    signal: str
    value: float | Change
    begin: float = 0.0
    end: float = inf
    repair: bool = True

    @property
    def message(self) -> str:
        """Name of the message."""
        return self.signal.partition(".")[0]

    def __str__(self) -> str:
        return f"{self.signal} altered"


Edit = Drop | Delay | Alter


def edited(log: FrameLog, database: Database, edits: Sequence[Edit]) -> FrameLog:
    """The log after the edits, in their order, sorted by time.

    Raises InputError where the database lacks a message or signal, a signal cannot hold a value, or
    an edit concerns no frame of the log.
    """
    origin_ns = int(log.time_ns[0]) if len(log) else 0
    for edit in edits:
        message = database.message(edit.message)
        times = np.asarray((log.time_ns - origin_ns) * 1e-9, np.float64)
        rows = _rows(log, message, edit, times)
        if isinstance(edit, Alter):
            log = _altered(log, message, edit, rows, times)
        elif isinstance(edit, Delay):
            log = _delayed(log, edit, rows)
        else:
            kept = np.setdiff1d(np.arange(len(log)), rows)
            log = log.select(kept)
            log = _counted(log, message, times[kept] < edit.begin) if edit.repair else log
    return log


def _rows(log: FrameLog, message: Message, edit: Edit, times: Times) -> Rows:
    """Rows of the frames that an edit concerns, shape (n,). times: s, of each frame of the log."""
    rows = np.flatnonzero(_of(log, message) & (times >= edit.begin) & (times < edit.end))
    if not rows.size:
        last = float(times[-1]) if times.size else 0.0
        raise InputError(
            f"the edit ({edit}) concerns no frame of the log",
            expected=f"frames of {message.name} from {edit.begin:g} s to {edit.end:g} s",
            found=f"{int(np.sum(_of(log, message)))} frames of it in {last:g} s",
            remedy="correct the message or the times, which count from the first frame",
        )
    return rows


def _of(log: FrameLog, message: Message) -> npt.NDArray[np.bool_]:
    """Which frames are of a message and as long as it, shape (n,)."""
    same = (log.identifier == message.identifier) & (log.extended == message.extended)
    return np.asarray(same & (log.length >= message.length))


def _delayed(log: FrameLog, edit: Delay, rows: Rows) -> FrameLog:
    time_ns = log.time_ns.copy()
    time_ns[rows] += round(edit.by * 1e9)
    moved = replace(log, time_ns=time_ns)
    return moved.select(np.argsort(time_ns, kind="stable"))


def _altered(log: FrameLog, message: Message, edit: Alter, rows: Rows, times: Times) -> FrameLog:
    signal = message.signal(edit.signal.partition(".")[2])
    data = log.data.copy()
    for row in rows.tolist():
        payload = data[row, : log.length[row]].tobytes()
        value = value_in(message, signal, payload)
        if value is None:
            continue
        target = edit.value(float(times[row]), value) if callable(edit.value) else edit.value
        try:
            payload = with_raw(signal, payload, raw_of(signal, target))
        except (ValueError, OverflowError) as cause:
            raise InputError(
                f"{edit.signal} cannot carry {target!r}",
                expected="a value that the signal can hold",
                found=str(cause),
            ) from cause
        _write(data, row, protect(message, payload) if edit.repair else payload)
    return replace(log, data=data)


def _counted(log: FrameLog, message: Message, before: npt.NDArray[np.bool_]) -> FrameLog:
    """Log in which the counters of a message increase by one, except `before`, shape (n,)."""
    data = log.data.copy()
    counter: int | None = None
    for row in np.flatnonzero(_of(log, message)).tolist():
        payload = data[row, : log.length[row]].tobytes()
        if counter is None or before[row]:
            counter = counter_in(message, payload)
            continue
        counter = (counter + 1) % e2e.PERIOD
        _write(data, row, protect(message, payload, counter))
    return replace(log, data=data)


def _write(data: npt.NDArray[np.uint8], row: int, payload: bytes) -> None:
    data[row, : len(payload)] = np.frombuffer(payload, np.uint8)
