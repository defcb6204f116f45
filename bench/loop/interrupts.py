"""Ctrl-C, SIGTERM and the loss of the terminal: a trial first returns control to the rider."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.process import BaseProcess
from types import FrameType
from typing import Any


def termination_signals() -> tuple[signal.Signals, ...]:
    """Signals that ask a process to end; without SIGHUP where it is ignored, as under `nohup`."""
    lost = getattr(signal, "SIGHUP", None)  # POSIX only
    if lost is None or signal.getsignal(lost) == signal.SIG_IGN:
        return signal.SIGINT, signal.SIGTERM
    return signal.SIGINT, signal.SIGTERM, lost


def start(process: BaseProcess) -> None:
    """Start a process that is not interrupted before it can handle signals.

    SIGINT and SIGHUP are blocked until it calls `interrupts` or `ignore_interrupts`. Otherwise they
    would end it with a traceback while it imports its modules.
    """
    start_resource_tracker()
    with _signals_blocked():
        process.start()


def start_resource_tracker() -> None:
    """Start multiprocessing's resource tracker with SIGINT and SIGHUP blocked.

    The tracker removes shared memory. Call this before the first shared memory is created, which
    would start the tracker without blocked signals.
    """
    if hasattr(signal, "pthread_sigmask"):
        with _signals_blocked():
            resource_tracker.ensure_running()


@contextmanager
def keyboard_interrupt_on_signals() -> Iterator[None]:
    """Raise KeyboardInterrupt on each of the termination signals, so that open files are closed."""
    before = {
        number: signal.signal(number, signal.default_int_handler)
        for number in termination_signals()
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def ignore_interrupts() -> None:
    """Ignore Ctrl-C and the loss of the terminal: the parent process ends this one."""
    for number in set(termination_signals()) - {signal.SIGTERM}:
        signal.signal(number, signal.SIG_IGN)
    _unblock_signals()


@contextmanager
def _signals_blocked() -> Iterator[None]:
    """Block SIGINT and SIGHUP in this process and in its children until the block ends."""
    if not hasattr(signal, "pthread_sigmask"):  # POSIX only
        yield
        return
    # Another thread may still receive them: collect them here, and block them for the children.
    pending: list[int] = []
    handlers: dict[int, Any] = {
        int(number): signal.signal(number, lambda caught, _frame: pending.append(caught))
        for number in termination_signals()
        if threading.current_thread() is threading.main_thread()
    }
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number in dict.fromkeys(pending):
            signal.raise_signal(number)


def _unblock_signals() -> None:
    """Unblock the signals that `start` blocked in a new process."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, signal.SIGHUP})


@contextmanager
def interrupts(stop: threading.Event) -> Iterator[None]:
    """Set `stop` on each of the termination signals until the block ends."""

    def handle(_signal: int, _frame: FrameType | None) -> None:
        stop.set()

    before = {number: signal.signal(number, handle) for number in termination_signals()}
    _unblock_signals()
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
