"""Laws of a real-time process: the rights that it requests, reports and returns."""

import errno
import multiprocessing
import os

import pytest

from slipbench.bench.loop.realtime_process import (
    _CLAIMS,
    RECORDER_PRIORITY,
    THREADS,
    one_processor,
    realtime_process,
    run_before_ordinary_processes,
)

needs_linux = pytest.mark.skipif(
    not hasattr(os, "sched_setaffinity"), reason="this system does not bind processes to processors"
)


def _on_one_processor() -> tuple[bool, int, list[str]]:
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    alone = one_processor()
    with realtime_process(shares_one_processor=alone) as refused:
        return alone, os.sched_getscheduler(0), list(refused)


@needs_linux
def test_with_one_processor_the_receivers_are_not_preempted() -> None:
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        alone, policy, refused = pool.apply(_on_one_processor)
    assert alone
    assert policy == os.SCHED_OTHER
    assert any("SCHED_FIFO" in words and "receivers" in words for words in refused)


@pytest.mark.parametrize("number", range(len(_CLAIMS)))
def test_every_refused_right_is_reported_with_name_and_reason(
    number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse() -> None:
        raise PermissionError(errno.EPERM, os.strerror(errno.EPERM))

    claims = [(what, lambda: lambda: None) for what, _ in _CLAIMS]
    claims[number] = (claims[number][0], refuse)
    monkeypatch.setattr("slipbench.bench.loop.realtime_process._CLAIMS", tuple(claims))
    with realtime_process() as refused:
        assert refused == [f"{claims[number][0]} was refused: {os.strerror(errno.EPERM)}"]


@needs_linux
def test_every_granted_right_is_returned() -> None:
    before = os.sched_getscheduler(0)
    with realtime_process() as refused:
        said = any("SCHED_FIFO" in words for words in refused)
        assert (os.sched_getscheduler(0) == os.SCHED_FIFO) != said
    assert os.sched_getscheduler(0) == before


def _priorities_of_all_threads() -> tuple[list[tuple[int, int]], list[str]]:
    import numpy as np

    np.linalg.solve(np.eye(300), np.ones(300))  # its library has threads of its own from here on
    with realtime_process() as refused:
        pass
    run_before_ordinary_processes()
    threads = [int(thread.name) for thread in THREADS.iterdir()]
    return [
        (os.sched_getscheduler(thread), os.sched_getparam(thread).sched_priority)
        for thread in threads
    ], list(refused)


@needs_linux
def test_no_thread_of_the_recorder_waits_for_ordinary_processes() -> None:
    """A killed process ends with the last of its threads: 400 ms later under load."""
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        priorities, refused = pool.apply(_priorities_of_all_threads)
    allowed = not any("SCHED_FIFO" in words for words in refused)
    expected = (os.SCHED_FIFO, RECORDER_PRIORITY) if allowed else (os.SCHED_OTHER, 0)
    assert set(priorities) == {expected}
