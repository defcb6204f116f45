"""Ctrl-C, or a polite kill, asks for an end; what has authority hands it back first."""

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def interrupts(stop: threading.Event) -> Iterator[None]:
    """Let the operator's Ctrl-C, or a polite kill, set `stop` for as long as the block lasts."""

    def ask(_signal: int, _frame: FrameType | None) -> None:
        stop.set()

    before = {number: signal.signal(number, ask) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
