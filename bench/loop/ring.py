"""A bounded ring of frames between the loop and the recorder: one writer, one reader, no lock.

The loop must never wait for a disk. It copies a frame into the next free slot and moves a
counter; the recorder, in a process of its own, follows. A full ring refuses: the trial trips.
"""

import os
import struct
from collections.abc import Iterator
from multiprocessing.shared_memory import SharedMemory
from typing import NamedTuple

from slipbench.bench.loop.interrupts import start_resource_tracker

SLOT = struct.Struct("=qIBBxx64s")
HEADER = 64  # bytes: written, read, closed, failed, each a uint64
WRITTEN, READ, CLOSED, FAILED = range(4)

EXTENDED, FD, SENT, BIT_RATE_SWITCH, ERROR, REMOTE = 1, 2, 4, 8, 16, 32
TICK, PHASE = 64, 128  # no frame, but what the loop says of itself (bench/loop/ticks.py)
UNKNOWN_CAUSE = 1 << 32  # beyond every errno: a failure of which nobody said why


class Slot(NamedTuple):
    """One frame as it lies in the ring."""

    time_ns: int
    identifier: int
    flags: int
    data: bytes


class Ring:
    """Frames in a buffer that two processes may share."""

    def __init__(self, buffer: memoryview, slots: int) -> None:
        """Lay a ring of `slots` frames over `buffer`; its first bytes hold the counters."""
        self._slots = slots
        self._counters = buffer[:HEADER].cast("Q")  # one aligned store each: never seen half
        self._frames = buffer[HEADER : HEADER + slots * SLOT.size]

    @staticmethod
    def size(slots: int) -> int:
        """Give the bytes that a ring of `slots` frames needs."""
        return HEADER + slots * SLOT.size

    @classmethod
    def local(cls, slots: int = 1 << 14) -> "Ring":
        """Make a ring for use inside one process."""
        return cls(memoryview(bytearray(cls.size(slots))), slots)

    def append(self, time_ns: int, identifier: int, flags: int, data: bytes) -> bool:
        """Add a frame; False, and nothing written, where the ring is full."""
        counters = self._counters
        written = counters[WRITTEN]
        if written - counters[READ] >= self._slots:
            return False
        SLOT.pack_into(
            self._frames,
            (written % self._slots) * SLOT.size,
            time_ns,
            identifier,
            flags,
            len(data),
            data,
        )
        counters[WRITTEN] = written + 1
        return True

    def drain(self) -> Iterator[Slot]:
        """Take out every frame that was in the ring when this began, oldest first."""
        counters = self._counters
        read, written = counters[READ], counters[WRITTEN]
        for index in range(read, written):
            at = (index % self._slots) * SLOT.size
            time_ns, identifier, flags, length, data = SLOT.unpack_from(self._frames, at)
            yield Slot(time_ns, identifier, flags, data[:length])
            counters[READ] = index + 1

    def close(self) -> None:
        """Say that no frame will follow."""
        self._counters[CLOSED] = 1

    def fail(self, why: int = UNKNOWN_CAUSE) -> None:
        """Say that the reader cannot write what it takes out; why: errno. The first word stays."""
        self._counters[FAILED] = self._counters[FAILED] or why

    @property
    def closed(self) -> bool:
        """Tell whether the writer is done."""
        return bool(self._counters[CLOSED])

    @property
    def failed(self) -> bool:
        """Tell whether the reader gave up."""
        return bool(self._counters[FAILED])

    @property
    def why_failed(self) -> str:
        """Say what kept the reader from writing; empty where it did not fail, or did not say."""
        why = self._counters[FAILED]
        return os.strerror(why) if 0 < why < UNKNOWN_CAUSE else ""

    @property
    def written(self) -> int:
        """Count what was ever put in."""
        return self._counters[WRITTEN]

    def release(self) -> None:
        """Let go of the buffer, so that shared memory can be closed."""
        self._counters.release()
        self._frames.release()


def create_shared(slots: int = 1 << 16) -> tuple[SharedMemory, Ring]:
    """Make a ring in shared memory; the default holds about 15 s of a bus at 60 % load."""
    start_resource_tracker()
    memory = SharedMemory(create=True, size=Ring.size(slots))
    return memory, Ring(_buffer(memory), slots)


def attach_shared(name: str, slots: int = 1 << 16) -> tuple[SharedMemory, Ring]:
    """Open the ring that another process made."""
    memory = SharedMemory(name=name)
    return memory, Ring(_buffer(memory), slots)


def _buffer(memory: SharedMemory) -> memoryview:
    if memory.buf is None:
        raise ValueError(f"shared memory {memory.name} is closed")
    return memory.buf
