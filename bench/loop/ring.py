"""Ring buffer of frames between the loop and the recorder: one writer, one reader, no lock.

The loop must never wait for a disk. It copies a frame into the next free slot and increments a
counter; the recorder reads in a process of its own. A full ring rejects the frame and the trial trips.
"""

import os
import struct
from collections.abc import Iterator
from multiprocessing.shared_memory import SharedMemory
from typing import NamedTuple

from slipbench.bench.loop.interrupts import start_resource_tracker

SLOT = struct.Struct("=qIBBBx64s")
HEADER = 64  # bytes: written, read, closed, failed, each a uint64
WRITTEN, READ, CLOSED, FAILED = range(4)

EXTENDED, FD, SENT, BIT_RATE_SWITCH, ERROR, REMOTE = 1, 2, 4, 8, 16, 32
TICK, PHASE = 64, 128  # not a frame but a tick or a phase of the loop (bench/loop/ticks.py)
UNKNOWN_CAUSE = 1 << 32  # above every errno: a failure with an unknown cause


class Slot(NamedTuple):
    """One entry of the ring. time_ns: ns; data: payload of up to 64 bytes; bus: its number."""

    time_ns: int
    identifier: int
    flags: int
    data: bytes
    bus: int = 0


class Ring:
    """Ring buffer of frames, in memory that two processes may share."""

    def __init__(self, buffer: memoryview, slots: int) -> None:
        """Use `buffer` for `slots` frames; its first `HEADER` bytes hold the counters."""
        self._slots = slots
        self._counters = buffer[:HEADER].cast("Q")  # aligned 64-bit stores, which are atomic
        self._frames = buffer[HEADER : HEADER + slots * SLOT.size]

    @staticmethod
    def size(slots: int) -> int:
        """Size of a ring of `slots` frames, bytes."""
        return HEADER + slots * SLOT.size

    @classmethod
    def local(cls, slots: int = 1 << 14) -> "Ring":
        """Ring for use inside one process."""
        return cls(memoryview(bytearray(cls.size(slots))), slots)

    def append(self, time_ns: int, identifier: int, flags: int, data: bytes, bus: int = 0) -> bool:
        """Whether the frame was written; False where the ring is full."""
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
            bus,
            data,
        )
        counters[WRITTEN] = written + 1
        return True

    def drain(self) -> Iterator[Slot]:
        """Remove and yield every frame that is in the ring at the first step, oldest first."""
        counters = self._counters
        read, written = counters[READ], counters[WRITTEN]
        for index in range(read, written):
            at = (index % self._slots) * SLOT.size
            time_ns, identifier, flags, length, bus, data = SLOT.unpack_from(self._frames, at)
            yield Slot(time_ns, identifier, flags, data[:length], bus)
            counters[READ] = index + 1

    def close(self) -> None:
        """State that no frame will follow."""
        self._counters[CLOSED] = 1

    def fail(self, why: int = UNKNOWN_CAUSE) -> None:
        """State that the recorder failed. why: errno; the first call determines the cause."""
        self._counters[FAILED] = self._counters[FAILED] or why

    @property
    def closed(self) -> bool:
        """Whether the writer has closed the ring."""
        return bool(self._counters[CLOSED])

    @property
    def failed(self) -> bool:
        """Whether the recorder failed."""
        return bool(self._counters[FAILED])

    @property
    def why_failed(self) -> str:
        """Cause of the failure in words; empty without a failure, or where the cause is unknown."""
        why = self._counters[FAILED]
        return os.strerror(why) if 0 < why < UNKNOWN_CAUSE else ""

    @property
    def written(self) -> int:
        """Number of entries that were ever written."""
        return self._counters[WRITTEN]

    def release(self) -> None:
        """Release the buffer, so that shared memory can be closed."""
        self._counters.release()
        self._frames.release()


def create_shared(slots: int = 1 << 16) -> tuple[SharedMemory, Ring]:
    """New ring in shared memory; the default holds about 15 s of a bus at 60 % load."""
    start_resource_tracker()
    memory = SharedMemory(create=True, size=Ring.size(slots))
    return memory, Ring(_buffer(memory), slots)


def attach_shared(name: str, slots: int = 1 << 16) -> tuple[SharedMemory, Ring]:
    """Ring that another process created, with its shared memory."""
    memory = SharedMemory(name=name)
    return memory, Ring(_buffer(memory), slots)


def _buffer(memory: SharedMemory) -> memoryview:
    if memory.buf is None:
        raise ValueError(f"shared memory {memory.name} is closed")
    return memory.buf
