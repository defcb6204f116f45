"""A simulation in a process of its own: one that hangs or crashes ends that process alone.

The process is forked, so the simulation may be anything that this process holds. Where no process
can be forked (Windows), or forking is unsafe (macOS), a simulation runs in this process.
"""

import multiprocessing
import signal
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.context import ForkProcess
from threading import Lock

from slipbench.identification.mismatch.callables.call import (
    Call,
    Caller,
    CallFailedError,
    SimulationLostError,
)
from slipbench.plant.signals import Floats

CAN_ISOLATE = sys.platform == "linux"
MOST_LOST = 3
"""Processes that may hang or crash before the simulation is given up."""
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
    """Runs calls in a process of its own, which is replaced after it hung or crashed."""

    def __init__(self, caller: Caller, limit: float) -> None:
        """limit: of one run, s."""
        self._caller, self._limit = caller, limit
        self._worker: Worker | None = None
        self._lost = 0
        self._lock = Lock()

    def __call__(self, call: Call) -> dict[str, Floats]:
        """Run a call. Raises CallFailedError; SimulationLostError after several lost processes."""
        with self._lock:
            if self._lost >= MOST_LOST:
                raise SimulationLostError(f"it hung or crashed {self._lost} times: given up")
            self._worker = self._worker or started(self._caller)
            try:
                return self._answer(self._worker, call)
            except CallFailedError:
                raise
            except BaseException:  # Ctrl-C: its answer is not waited for
                self.close()
                raise

    def close(self) -> None:
        """End the process."""
        if self._worker is not None:
            self._worker.end()
            self._worker = None

    def _answer(self, worker: Worker, call: Call) -> dict[str, Floats]:
        try:
            worker.calls.send(call)
            if not worker.calls.poll(self._limit):
                raise self._lose(f"it did not return within {self._limit:g} s")
            told = worker.calls.recv()
        except (EOFError, OSError) as fault:
            worker.process.join(GRACE)
            raise self._lose(f"its process ended: {ending(worker.process.exitcode)}") from fault
        if isinstance(told, str):
            raise CallFailedError(told)
        outputs: dict[str, Floats] = told
        return outputs

    def _lose(self, why: str) -> CallFailedError:
        self._lost += 1
        self.close()
        return CallFailedError(why)


def started(caller: Caller) -> Worker:
    """Start a process that serves calls."""
    context = multiprocessing.get_context("fork")
    here, there = context.Pipe()
    process = context.Process(target=_serve, args=(caller, there, here), daemon=True)
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


def _serve(caller: Callable[[Call], object], calls: Connection, other: Connection) -> None:
    """Serve calls until nobody asks; failures are answered with their text."""
    other.close()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the process that asks
    with suppress(EOFError, BrokenPipeError):
        while True:
            call = calls.recv()
            try:
                calls.send(caller(call))
            except CallFailedError as fault:
                calls.send(str(fault))
