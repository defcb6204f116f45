"""Cost of recording within a tick: writes to the ring in shared memory."""

import time

from slipbench.bench.loop.ring import SENT, create_shared
from slipbench.bench.loop.ticks import tick_recorder

CALLS, ROUNDS = 1000, 50


def measure() -> dict[str, float]:
    """Cost of a frame and of a tick, us of processor time: the median of many rounds."""
    memory, ring = create_shared(1 << 12)
    note, data = tick_recorder(ring), bytes(8)
    frames, ticks = [], []
    for _ in range(ROUNDS):
        start = time.process_time_ns()
        for number in range(CALLS):
            ring.append(number, 0x10, SENT, data)
        half = time.process_time_ns()
        for number in range(CALLS):
            note(number, number, 1000, False)
        frames.append(half - start)
        ticks.append(time.process_time_ns() - half)
        list(ring.drain())
    ring.release()
    memory.close()
    memory.unlink()
    return {
        name: sorted(times)[ROUNDS // 2] / CALLS * 1e-3
        for name, times in (("a frame", frames), ("a tick", ticks))
    }
