"""Recorder: appends every frame that the gateway sent or received to a candump log.

The lines are written at once and in order. A killed recorder loses at most the frames that were still
in the ring and an incomplete last line. The ticks of the loop go into a table beside the log.
"""

import multiprocessing
import os
import signal
import time
from collections.abc import Iterable, Sequence
from contextlib import ExitStack
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import BinaryIO

from slipbench.bench.loop.interrupts import ignore_interrupts, start
from slipbench.bench.loop.realtime_process import run_before_ordinary_processes
from slipbench.bench.loop.ring import (
    BIT_RATE_SWITCH,
    ERROR,
    EXTENDED,
    FD,
    REMOTE,
    SENT,
    TICK,
    UNKNOWN_CAUSE,
    Ring,
    Slot,
    attach_shared,
)
from slipbench.bench.loop.ticks import HEADER, TICKS, TickTable
from slipbench.protocol.logs.candump_line import ERROR_FLAG
from slipbench.protocol.recording.run_folder import FRAMES

PAUSE = 0.005  # s between two reads of the ring
JOIN = 30.0  # s within which the recorder must write the remaining frames
ORPHANED = 0.5  # s without an entry after which a recorder without a parent ends


def candump_line(frame: Slot, bus: str) -> str:
    """One frame in the format of `candump -L -x`: time, bus, frame, T (sent) or R (received)."""
    seconds, nanoseconds = divmod(frame.time_ns, 1_000_000_000)
    number = frame.identifier | (ERROR_FLAG if frame.flags & ERROR else 0)
    identifier = f"{number:08X}" if frame.flags & (EXTENDED | ERROR) else f"{number:03X}"
    if frame.flags & FD:
        mark = f"##{1 if frame.flags & BIT_RATE_SWITCH else 0:X}"
    else:
        mark = "#R" if frame.flags & REMOTE else "#"
    direction = "T" if frame.flags & SENT else "R"
    return (
        f"({seconds:010d}.{nanoseconds // 1000:06d}) {bus} "
        f"{identifier}{mark}{frame.data.hex().upper()} {direction}\n"
    )


class Recorder:
    """Drains a ring into an append-only log of frames and one of ticks."""

    def __init__(
        self, ring: Ring, log: BinaryIO, buses: Sequence[str], ticks: BinaryIO, table: TickTable
    ) -> None:
        """Write the frames of `ring` to `log`, and its ticks to `ticks`. Both files are unbuffered.

        buses: names of the buses in the log, by their numbers in the ring
        """
        self._ring, self._log, self._ticks, self._table = ring, log, ticks, table
        self._buses = tuple(buses)
        self.lines = 0
        self.error = ""
        self._append(ticks, [HEADER])

    def drain(self) -> int:
        """Number of frames and ticks that were in the ring, after writing them.

        A write error marks the ring as failed, so that the loop reads it.
        """
        slots = list(self._ring.drain())
        frames = [
            candump_line(slot, self._buses[slot.bus]) for slot in slots if not slot.flags & TICK
        ]
        self._append(self._log, frames)
        self._append(self._ticks, [self._table.lines(slot) for slot in slots if slot.flags & TICK])
        self.lines += 0 if self.error else len(frames)
        return len(slots)

    def _append(self, file: BinaryIO, lines: Iterable[str]) -> None:
        text = "".join(lines)
        if not text or self.error:
            return
        try:
            _write_all(file, text.encode("ascii"))
        except OSError as fault:
            self.error = str(fault)
            self._ring.fail(fault.errno or UNKNOWN_CAUSE)


def _write_all(log: BinaryIO, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[log.write(view) :]


def recorder_failure(ring: Ring) -> list[str]:
    """Notes on why the recorder did not write all of `ring`; none where it did."""
    if not ring.failed:
        return []
    if ring.why_failed:
        return [f"the recorder could not write: {ring.why_failed}"]
    return ["the recorder could not keep up with the ring"]


def open_log(path: Path) -> BinaryIO:
    """New unbuffered log file. Raises FileExistsError where it exists."""
    return path.open("xb", buffering=0)


def start_recorder(
    ring_name: str,
    folder: Path,
    buses: Sequence[str],
    table: TickTable,
    pipe: Connection | None = None,
) -> BaseProcess:
    """Process of the recorder, started; it shares no interpreter with the loop.

    pipe  watched end of `process_pipe`: the kernel closes it when the recorder ends
    """
    process = multiprocessing.get_context("spawn").Process(
        target=_record,
        args=(ring_name, folder, tuple(buses), table, os.getpid(), pipe),
        name="slipbench recorder",
    )
    start(process)
    if pipe is not None:
        pipe.close()
    return process


def _record(
    ring_name: str,
    folder: Path,
    buses: Sequence[str],
    table: TickTable,
    parent: int,
    _pipe: Connection | None = None,
) -> None:
    """Record from the ring until it is closed, or until the processes that write to it have ended.

    Ctrl-C and the loss of the terminal reach every process of the terminal. They are ignored here:
    they end the trial, and the end of the trial ends the recorder.
    """
    ignore_interrupts()
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    run_before_ordinary_processes()
    memory, ring = attach_shared(ring_name)
    with ExitStack() as files:
        log, ticks = (files.enter_context(open_log(folder / name)) for name in (FRAMES, TICKS))
        recorder = Recorder(ring, log, buses, ticks, table)
        last_entry = time.monotonic()
        while True:
            now = time.monotonic()
            if os.getppid() == parent:
                last_entry = now
            last_round = ring.closed or now - last_entry > ORPHANED
            if recorder.drain():
                last_entry = now
            if last_round:
                break
            time.sleep(PAUSE)
    ring.release()
    memory.close()
