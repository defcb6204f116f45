"""Ctrl-C, a polite kill, or a terminal that is gone: what has authority hands it back first."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.process import BaseProcess
from types import FrameType
from typing import Any


def termination_signals() -> tuple[signal.Signals, ...]:
    """Name the signals that ask for an end; not that of a lost terminal under `nohup`."""
    lost = getattr(signal, "SIGHUP", None)  # POSIX only
    if lost is None or signal.getsignal(lost) == signal.SIG_IGN:
        return signal.SIGINT, signal.SIGTERM
    return signal.SIGINT, signal.SIGTERM, lost


def start(process: BaseProcess) -> None:
    """Start a process that is not interrupted before it can handle it.

    It begins with Ctrl-C and the loss of its terminal held back, until it calls `interrupts` or
    `ignore_interrupts`; either would end it with a traceback while it is still importing.
    """
    start_resource_tracker()
    with _held_back():
        process.start()


def start_resource_tracker() -> None:
    """Start multiprocessing's process that removes shared memory, so that a lost terminal spares it.

    Called before the first shared memory is made, which would start it otherwise.
    """
    if hasattr(signal, "pthread_sigmask"):
        with _held_back():
            resource_tracker.ensure_running()


@contextmanager
def keyboard_interrupt_on_signals() -> Iterator[None]:
    """Raise KeyboardInterrupt for all that ask for an end, so that what is open is closed."""
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
    """Ignore Ctrl-C and the loss of the terminal: whoever started this process tells it to end."""
    for number in set(termination_signals()) - {signal.SIGTERM}:
        signal.signal(number, signal.SIG_IGN)
    _let_through()


@contextmanager
def _held_back() -> Iterator[None]:
    """Hold Ctrl-C and the loss of the terminal back until the block ends, here and in children."""
    if not hasattr(signal, "pthread_sigmask"):  # POSIX only
        yield
        return
    came: list[int] = []  # another thread may receive what this one blocks: children need the mask
    handlers: dict[int, Any] = {
        int(number): signal.signal(number, lambda caught, _frame: came.append(caught))
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
        for number in dict.fromkeys(came):
            signal.raise_signal(number)


def _let_through() -> None:
    """End what `start` holds back in a new process."""
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT, signal.SIGHUP})


@contextmanager
def interrupts(stop: threading.Event) -> Iterator[None]:
    """Let each of them set `stop` for as long as the block lasts."""

    def ask(_signal: int, _frame: FrameType | None) -> None:
        stop.set()

    before = {number: signal.signal(number, ask) for number in termination_signals()}
    _let_through()
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
