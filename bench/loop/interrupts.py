"""Ctrl-C, a polite kill, or a terminal that is gone: what has authority hands it back first."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


def asking() -> tuple[signal.Signals, ...]:
    """Name the signals that ask for an end; not that of a lost terminal under `nohup`."""
    lost = getattr(signal, "SIGHUP", None)  # POSIX only
    if lost is None or signal.getsignal(lost) == signal.SIG_IGN:
        return signal.SIGINT, signal.SIGTERM
    return signal.SIGINT, signal.SIGTERM, lost


@contextmanager
def interrupts(stop: threading.Event) -> Iterator[None]:
    """Let each of them set `stop` for as long as the block lasts."""

    def ask(_signal: int, _frame: FrameType | None) -> None:
        stop.set()

    before = {number: signal.signal(number, ask) for number in asking()}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
