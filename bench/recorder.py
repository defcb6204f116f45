"""The recorder: every frame that the gateway saw, appended to a candump log as it comes.

Text lines, written at once and in order, so that a killed process loses what was still in the
ring and a torn last line at the most.
"""

import multiprocessing
import os
import time
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import BinaryIO

from bench.ring import BIT_RATE_SWITCH, EXTENDED, FD, REMOTE, SENT, Ring, Slot, attach_shared

PAUSE = 0.005  # s between two looks at the ring
JOIN = 5.0  # s that the recorder has to write what is left


def candump_line(frame: Slot, bus: str) -> str:
    """Write one frame as `candump -L -x` does: time, bus, frame, and T for sent or R."""
    seconds, nanoseconds = divmod(frame.time_ns, 1_000_000_000)
    identifier = f"{frame.identifier:08X}" if frame.flags & EXTENDED else f"{frame.identifier:03X}"
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
    """Drains a ring into an append-only log."""

    def __init__(self, ring: Ring, log: BinaryIO, bus: str) -> None:
        """Write to `log`, an unbuffered binary file, the frames of `ring` as from `bus`."""
        self._ring, self._log, self._bus = ring, log, bus
        self.lines = 0
        self.trouble = ""

    def drain(self) -> None:
        """Write what is in the ring; a disk that refuses is told to the writer of the ring."""
        lines = [candump_line(frame, self._bus) for frame in self._ring.drain()]
        if not lines or self.trouble:
            return
        try:
            _write_all(self._log, "".join(lines).encode("ascii"))
            self.lines += len(lines)
        except OSError as fault:
            self.trouble = str(fault)
            self._ring.fail()


def _write_all(log: BinaryIO, data: bytes) -> None:
    view = memoryview(data)
    while view:
        view = view[log.write(view) :]


def open_log(path: Path) -> BinaryIO:
    """Open a new log; every write reaches the operating system before it returns."""
    return path.open("xb", buffering=0)


def start_recorder(ring_name: str, path: Path, bus: str) -> BaseProcess:
    """Start the recorder as a process of its own: it shares no interpreter with the loop."""
    process = multiprocessing.get_context("spawn").Process(
        target=_record, args=(ring_name, str(path), bus, os.getpid()), name="slipbench recorder"
    )
    process.start()
    return process


def _record(ring_name: str, path: str, bus: str, parent: int) -> None:
    """Follow the ring until it is closed, or until the loop's process is gone."""
    memory, ring = attach_shared(ring_name)
    with open_log(Path(path)) as log:
        recorder = Recorder(ring, log, bus)
        while True:
            last_round = ring.closed or os.getppid() != parent
            recorder.drain()
            if last_round:
                break
            time.sleep(PAUSE)
    ring.release()
    memory.close()
