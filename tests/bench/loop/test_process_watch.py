"""The end of a process is detected without a third process, and never too early."""

import multiprocessing
import os
import signal
import time

import pytest

from slipbench.bench.loop.clock import MILLISECOND, SimulatedClock
from slipbench.bench.loop.loop import run_ticks
from slipbench.bench.loop.process_watch import ProcessWatch, process_pipe

WITHIN = 60.0  # s, on a machine however loaded


def _wait(_pipe, begun) -> None:
    begun.set()
    time.sleep(WITHIN)


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_process_has_ended_once_it_was_killed_and_not_before(number: int) -> None:
    spawning = multiprocessing.get_context("spawn")
    ours, theirs = process_pipe()
    begun = spawning.Event()
    process = spawning.Process(target=_wait, args=(theirs, begun))
    process.start()
    theirs.close()
    watch = ProcessWatch(ours)
    assert begun.wait(WITHIN)
    assert not any(watch.ended() for _ in range(1000))
    assert process.pid
    os.kill(process.pid, number)
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)  # it has ended and was not reaped
    assert watch.ended()
    process.join()
    assert watch.ended()
    ours.close()


def test_ticks_without_a_history_allocate_nothing_for_ticks_to_come() -> None:
    """Arrays for eight hours of ticks were 490 MB of locked memory that the vehicle did not use."""
    import tracemalloc

    tracemalloc.start()
    try:
        run_ticks(lambda number, _due: number < 2000, MILLISECOND, SimulatedClock())
        _, most = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most < 100_000
