"""A simulation in separate processes: a hang or crash affects the worker process only.

A worker is forked, so the simulation may be any object of this process. Where processes cannot be
forked (Windows), or forking is unsafe (macOS), the simulation runs in this process.
"""

import multiprocessing
import signal
import sys
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import ForkProcess
from threading import Lock, Semaphore

from slipbench.identification.mismatch.callables.call import (
    Call,
    Caller,
    CallFailedError,
    SimulationLostError,
)
from slipbench.identification.mismatch.simulation.threads import WORKERS
from slipbench.plant.signals import Floats

CAN_ISOLATE = sys.platform == "linux"
MOST_LOST = 3
"""Number of hung or crashed processes after which the simulation is not run again."""
MOST_PROCESSES = min(WORKERS or 1, 8)
GRACE = 2.0  # s, join timeout of a killed process


@dataclass(frozen=True)
class Worker:
    """A process that serves calls sequentially."""

    process: ForkProcess
    calls: Connection

    def end(self) -> None:
        """Kill the process."""
        self.process.kill()
        self.process.join(GRACE)
        self.calls.close()


class IsolatedCaller:
    """Runs calls in worker processes; a hung or crashed worker is replaced.

    Calls of several threads run in parallel, each in its own process. The results do not depend on
    the number of processes.
    """

    def __init__(self, caller: Caller, limit: float, most: int = MOST_PROCESSES) -> None:
        """limit: timeout of one run, s. most: largest number of processes."""
        self._caller, self._limit = caller, limit
        self._slots, self._lock = Semaphore(most), Lock()
        self._most, self._lost, self._workers_started = most, 0, False
        self._free: list[Worker] = []
        self._alive: list[Worker] = []

    def __call__(self, call: Call) -> dict[str, Floats]:
        """Run a call. Raises CallFailedError; SimulationLostError after several lost processes."""
        with self._slots:
            worker = self._free_worker()
            try:
                outcome = self._result_of(worker, call)
            except CallFailedError:
                raise
            except BaseException:  # Ctrl-C: do not wait for the result
                self._remove(worker)
                raise
            self._free.append(worker)
        if isinstance(outcome, str):
            raise CallFailedError(outcome)
        return outcome

    def close(self) -> None:
        """Kill the worker processes."""
        with self._lock:
            for worker in self._alive:
                worker.end()
            self._alive.clear()
            self._free.clear()
            self._workers_started = False

    def _free_worker(self) -> Worker:
        """Return a free worker.

        All workers are started at the first call, before other threads run: a lock held by a thread
        at the time of a fork would stay locked in the forked process.
        """
        with self._lock:
            if self._lost >= MOST_LOST:
                raise SimulationLostError(f"it hung or crashed {self._lost} times: given up")
            if not self._workers_started:
                self._workers_started = True
                self._free += [self._new_worker() for _ in range(self._most)]
            return self._free.pop() if self._free else self._new_worker()

    def _new_worker(self) -> Worker:
        worker = started(self._caller, [other.calls for other in self._alive])
        self._alive.append(worker)
        return worker

    def _result_of(self, worker: Worker, call: Call) -> dict[str, Floats] | str:
        """Return outputs or the failure text. Raises CallFailedError where the process is lost."""
        try:
            worker.calls.send(call)
            if not worker.calls.poll(self._limit):
                raise self._count_lost(worker, f"it did not return within {self._limit:g} s")
            result: dict[str, Floats] | str = worker.calls.recv()
        except (EOFError, OSError) as fault:
            worker.process.join(GRACE)
            reason = f"its process ended: {ending(worker.process.exitcode)}"
            raise self._count_lost(worker, reason) from fault
        return result

    def _count_lost(self, worker: Worker, reason: str) -> CallFailedError:
        self._remove(worker)
        with self._lock:
            self._lost += 1
        return CallFailedError(reason)

    def _remove(self, worker: Worker) -> None:
        with self._lock:
            worker.end()
            if worker in self._alive:
                self._alive.remove(worker)


def started(caller: Caller, others: Sequence[Connection] = ()) -> Worker:
    """Start a worker process. caller: its outputs are (n,) each, see `Caller`.

    others: connections to other workers. The new process closes them; otherwise the other workers
    would outlive a killed analysis.
    """
    context = multiprocessing.get_context("fork")
    parent_end, child_end = context.Pipe()
    process = context.Process(
        target=_serve, args=(caller, child_end, (parent_end, *others)), daemon=True
    )
    with warnings.catch_warnings():  # fork with threads: the new process needs none of them
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    child_end.close()
    return Worker(process, parent_end)


def ending(code: int | None) -> str:
    """Return how a process ended, as text. code: its exit status, negative for a signal."""
    if code is None or code >= 0:
        return f"exit status {code}"
    with suppress(ValueError):
        return f"signal {-code} ({signal.Signals(-code).name})"
    return f"signal {-code}"


def _serve(
    caller: Callable[[Call], object], calls: Connection, others: Sequence[Connection]
) -> None:
    """Serve calls until the connection closes; a failure is returned as its text."""
    for other in others:
        if not other.closed:
            other.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is handled by the calling process
    with suppress(EOFError, BrokenPipeError):
        while True:
            call = calls.recv()
            try:
                calls.send(caller(call))
            except CallFailedError as fault:
                calls.send(str(fault))
