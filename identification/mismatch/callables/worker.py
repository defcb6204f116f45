"""A simulation in processes of its own: one that hangs or crashes ends its process alone.

A process is forked, so the simulation may be anything that this process holds. Where no process
can be forked (Windows), or forking is unsafe (macOS), a simulation runs in this process.
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
"""Processes that may hang or crash before the simulation is given up."""
MOST_PROCESSES = min(WORKERS or 1, 8)
GRACE = 2.0  # s that an ended process has to be gone


@dataclass(frozen=True)
class Worker:
    """A process that serves calls, one after another."""

    process: ForkProcess
    calls: Connection

    def end(self) -> None:
        """End the process, whatever it is doing."""
        self.process.kill()
        self.process.join(GRACE)
        self.calls.close()


class IsolatedCaller:
    """Runs calls in processes of their own; one that hung or crashed is replaced.

    Calls of several threads run at once, each in another process. What they return does not depend
    on how many there are.
    """

    def __init__(self, caller: Caller, limit: float, most: int = MOST_PROCESSES) -> None:
        """limit: of one run, s. most: processes."""
        self._caller, self._limit = caller, limit
        self._slots, self._lock = Semaphore(most), Lock()
        self._most, self._lost, self._begun = most, 0, False
        self._free: list[Worker] = []
        self._alive: list[Worker] = []

    def __call__(self, call: Call) -> dict[str, Floats]:
        """Run a call. Raises CallFailedError; SimulationLostError after several lost processes."""
        with self._slots:
            worker = self._taken()
            try:
                found = self._answer(worker, call)
            except CallFailedError:
                raise
            except BaseException:  # Ctrl-C: its answer is not waited for
                self._drop(worker)
                raise
            self._free.append(worker)
        if isinstance(found, str):
            raise CallFailedError(found)
        return found

    def close(self) -> None:
        """End the processes."""
        with self._lock:
            for worker in self._alive:
                worker.end()
            self._alive.clear()
            self._free.clear()
            self._begun = False

    def _taken(self) -> Worker:
        """Take a process that is free.

        All are started at the first call, when no other thread is at work yet: a lock that one holds
        would stay locked in a process that is forked meanwhile.
        """
        with self._lock:
            if self._lost >= MOST_LOST:
                raise SimulationLostError(f"it hung or crashed {self._lost} times: given up")
            if not self._begun:
                self._begun = True
                self._free += [self._started() for _ in range(self._most)]
            return self._free.pop() if self._free else self._started()

    def _started(self) -> Worker:
        worker = started(self._caller, [other.calls for other in self._alive])
        self._alive.append(worker)
        return worker

    def _answer(self, worker: Worker, call: Call) -> dict[str, Floats] | str:
        """Return outputs, or why there are none. Raises CallFailedError where the process is lost."""
        try:
            worker.calls.send(call)
            if not worker.calls.poll(self._limit):
                raise self._lose(worker, f"it did not return within {self._limit:g} s")
            told: dict[str, Floats] | str = worker.calls.recv()
        except (EOFError, OSError) as fault:
            worker.process.join(GRACE)
            why = f"its process ended: {ending(worker.process.exitcode)}"
            raise self._lose(worker, why) from fault
        return told

    def _lose(self, worker: Worker, why: str) -> CallFailedError:
        self._drop(worker)
        with self._lock:
            self._lost += 1
        return CallFailedError(why)

    def _drop(self, worker: Worker) -> None:
        with self._lock:
            worker.end()
            if worker in self._alive:
                self._alive.remove(worker)


def started(caller: Caller, others: Sequence[Connection] = ()) -> Worker:
    """Start a process that serves calls. others: connections to other such processes.

    The new process closes them: else these would outlive an analysis that was killed.
    """
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe()
    process = context.Process(target=_serve, args=(caller, there, (here, *others)), daemon=True)
    with warnings.catch_warnings():  # of threads that are not in the new process: none is needed
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    there.close()
    return Worker(process, here)


def ending(code: int | None) -> str:
    """Say how a process ended. code: its exit status, negative for a signal."""
    if code is None or code >= 0:
        return f"exit status {code}"
    with suppress(ValueError):
        return f"signal {-code} ({signal.Signals(-code).name})"
    return f"signal {-code}"


def _serve(
    caller: Callable[[Call], object], calls: Connection, others: Sequence[Connection]
) -> None:
    """Serve calls until nobody asks; failures are answered with their text."""
    for other in others:
        if not other.closed:
            other.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    with suppress(EOFError, BrokenPipeError):
        while True:
            call = calls.recv()
            try:
                calls.send(caller(call))
            except CallFailedError as fault:
                calls.send(str(fault))
