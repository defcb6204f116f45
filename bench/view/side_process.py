"""A process beside a trial that serves what is recorded, and ends with the command.

It reads the files that the recorder writes. Loop and recorder do not know of it; one that is slow, or
killed, changes neither the trial nor its recording.
"""

import multiprocessing
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from typing import Any

from slipbench.bench.loop.interrupts import ignore_interrupts, start
from slipbench.protocol.errors import InputError

STARTING = 30.0  # s that the process has to start
NICENESS = 10  # below every process of the trial
FAREWELL = "end"


@contextmanager
def side_process(
    name: str,
    serve: Callable[[Any, Connection], None],
    order: Any,
    say: Callable[[str], None],
    ending: float,
) -> Iterator[None]:
    """Run `serve(order, pipe)` in a process until the block ends.

    serve   sends through the pipe its lines for people, or the InputError why it cannot serve; it
            ends after it receives something, or when the pipe is closed
    ending  s that it has to end

    Raises the InputError of the process, or one that says that it did not start.
    """
    spawning = multiprocessing.get_context("spawn")
    ours, theirs = spawning.Pipe()
    process = spawning.Process(target=serve, args=(order, theirs), name=f"slipbench {name}")
    start(process)
    theirs.close()
    try:
        for line in _started(ours, name):
            say(line)
        yield
    finally:
        with suppress(OSError):
            ours.send(FAREWELL)
        process.join(ending + STARTING)
        ours.close()
        if process.is_alive():
            process.kill()
            process.join()


def _started(pipe: Connection, name: str) -> list[str]:
    """Lines for people from the process. Raises InputError where it did not start."""
    response: list[str] | InputError = InputError(f"the {name} did not start")
    if pipe.poll(STARTING):
        with suppress(EOFError):
            response = pipe.recv()
    if isinstance(response, InputError):
        raise response
    return response


def begin_beside() -> None:
    """Leave Ctrl-C and the processors to the trial: the first call of the process."""
    ignore_interrupts()
    os.nice(NICENESS)
