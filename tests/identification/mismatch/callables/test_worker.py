"""Several processes serve the calls of several threads, and none outlives the analysis."""

import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Thread

import numpy as np
import pytest

from slipbench.identification.mismatch.callables.call import Call
from slipbench.identification.mismatch.callables.worker import CAN_ISOLATE, IsolatedCaller

pytestmark = pytest.mark.skipif(not CAN_ISOLATE, reason="processes are forked on Linux only")
LIMIT = 60.0  # s
TIMES = np.arange(3) * 0.01


def call_of(gain: float) -> Call:
    return Call({"gain": gain}, {}, TIMES, ("process", "gain"))


def result_of(call: Call) -> dict[str, np.ndarray]:
    """The process that serves it, and its parameter."""
    return {
        "process": np.full(TIMES.size, float(os.getpid())),
        "gain": np.full(TIMES.size, call.parameters["gain"]),
    }


def test_calls_of_several_threads_run_at_once_each_with_its_own_result(tmp_path: Path) -> None:
    """Each waits for all others to have begun, which no single process could pass."""
    together = 3

    def meet(call: Call) -> dict[str, np.ndarray]:
        (tmp_path / f"{call.parameters['gain']}").touch()
        while len(list(tmp_path.iterdir())) < together:
            time.sleep(0.01)
        return result_of(call)

    caller = IsolatedCaller(meet, LIMIT, together)
    with ThreadPoolExecutor(together) as pool:
        found = list(pool.map(lambda k: caller(call_of(float(k))), range(together)))
    caller.close()
    assert len({one["process"][0] for one in found}) == together
    assert [one["gain"][0] for one in found] == [0.0, 1.0, 2.0]


def test_more_threads_than_processes_are_served_one_after_another() -> None:
    caller = IsolatedCaller(result_of, LIMIT, 2)
    with ThreadPoolExecutor(6) as pool:
        found = list(pool.map(lambda k: caller(call_of(float(k))), range(30)))
    caller.close()
    assert len({one["process"][0] for one in found}) <= 2
    assert [one["gain"][0] for one in found] == [float(k) for k in range(30)]


def test_after_it_was_closed_it_starts_again() -> None:
    caller = IsolatedCaller(result_of, LIMIT, 1)
    first = caller(call_of(1.0))["process"][0]
    caller.close()
    assert caller(call_of(1.0))["process"][0] != first
    caller.close()


def test_a_process_that_is_idle_does_not_outlive_an_analysis_that_is_killed(tmp_path: Path) -> None:
    """Also while a worker that was started later hangs; it must not hold the connection."""
    pid_file, stuck = tmp_path / "processes", tmp_path / "stuck"

    def hang(call: Call) -> dict[str, np.ndarray]:
        stuck.write_text(str(os.getpid()))
        time.sleep(2.0 * LIMIT)
        return result_of(call)

    def analysis() -> None:
        caller = IsolatedCaller(hang, LIMIT, 2)
        Thread(target=caller, args=[call_of(1.0)]).start()
        while not stuck.exists() or not stuck.read_text():
            time.sleep(0.01)
        pid_file.write_text(" ".join(str(w.process.pid) for w in caller._alive))
        os.kill(os.getpid(), signal.SIGKILL)

    parent = multiprocessing.get_context("fork").Process(target=analysis)
    parent.start()
    wait_until(lambda: parent.exitcode is not None)  # join also waits for the worker that hangs
    hanging = int(stuck.read_text())
    (idle,) = {int(word) for word in pid_file.read_text().split()} - {hanging}
    try:
        wait_until(lambda: not runs(idle))
        assert not runs(idle)
    finally:
        os.kill(hanging, signal.SIGKILL)


def wait_until(done: Callable[[], bool]) -> None:
    end = time.monotonic() + LIMIT
    while not done() and time.monotonic() < end:
        time.sleep(0.01)


def runs(process: int) -> bool:
    """Whether a process is there and is no zombie."""
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
