"""Process of the live view: it serves the page beside a trial, and ends with the command.

It reads the files that the recorder writes. Loop and recorder do not know of it; a view that is slow,
or killed, changes neither the trial nor its recording.
"""

import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from slipbench.bench.loop.clock import MonotonicClock
from slipbench.bench.loop.interrupts import ignore_interrupts, start
from slipbench.bench.view.access import Access, Address
from slipbench.bench.view.live_run import LiveView
from slipbench.bench.view.server import application
from slipbench.bench.view.sources import LiveSource
from slipbench.bench.view.web import listen, require_web, run_server, urls
from slipbench.protocol.errors import InputError

STARTING = 30.0  # s that the server has to start
LOOKING = 30.0  # s that the quick look may take after the end
LAST_UPDATES = 0.3  # s, so that the pages get the last state
GLANCE, GLANCES = 0.05, 40  # s between two looks whether they have it, and their number
NICENESS = 10  # below every process of the trial
FAREWELL = "end"


@dataclass(frozen=True)
class ViewOrder:
    """Parameters of the process. take_look: nobody else takes the quick look of the run."""

    root: Path
    address: Address
    parent: int
    take_look: bool


@contextmanager
def live_view(
    root: Path, address: Address | None, say: Callable[[str], None], *, take_look: bool
) -> Iterator[None]:
    """Serve the view of what is recorded below `root` until the block ends; None: no view.

    say: receives lines for people, with the address to open. Raises InputError where the extra is
    missing or the address cannot be used.
    """
    if address is None:
        yield
        return
    require_web()
    spawning = multiprocessing.get_context("spawn")
    ours, theirs = spawning.Pipe()
    order = ViewOrder(root.absolute(), address, os.getpid(), take_look)
    process = spawning.Process(target=serve, args=(order, theirs), name="slipbench view")
    start(process)
    theirs.close()
    try:
        for line in _started(ours):
            say(line)
        yield
    finally:
        with suppress(OSError):
            ours.send(FAREWELL)
        process.join(LOOKING + STARTING)
        ours.close()
        if process.is_alive():
            process.kill()
            process.join()


def _started(pipe: Connection) -> list[str]:
    """Lines for people from the process. Raises InputError where it did not start."""
    answer: list[str] | InputError = InputError("the live view did not start")
    if pipe.poll(STARTING):
        with suppress(EOFError):
            answer = pipe.recv()
    if isinstance(answer, InputError):
        raise answer
    return answer


def serve(order: ViewOrder, pipe: Connection) -> None:
    """Serve the page until the command says that it ends, or has ended: main function of the process."""
    ignore_interrupts()
    os.nice(NICENESS)
    try:
        listening = listen(order.address)
    except InputError as fault:
        pipe.send(fault)
        return
    with listening:
        _serve(order, pipe, listening)


def _serve(order: ViewOrder, pipe: Connection, listening: socket.socket) -> None:

    access = Access(open_to_all=order.address.loopback)
    source = LiveSource(LiveView(order.root, MonotonicClock()))
    port = listening.getsockname()[1]
    app = application(source, access, f"slipbench_{port}", lambda: trip(source, order.parent))
    with run_server(app, listening):
        pipe.send(urls(order.address, port, access))
        with suppress(EOFError, OSError):  # the command was killed
            pipe.recv()
            _finish(order, source)


def _finish(order: ViewOrder, source: LiveSource) -> None:
    """After the trial: the quick look where a page waits for it, then the last updates."""
    if not source.watched:
        return
    pause = threading.Event()
    if order.take_look and order.root.exists():
        pause.wait(LAST_UPDATES)  # the outcome is shown before the quick look
        command = [sys.executable, "-m", "slipbench", "look", str(order.root)]
        with suppress(OSError, subprocess.TimeoutExpired):
            subprocess.run(
                command,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                timeout=LOOKING,
                check=False,
            )
    for _ in range(GLANCES):
        if source.told:
            break
        pause.wait(GLANCE)
    pause.wait(LAST_UPDATES)  # what was sent last is under way


def trip(source: LiveSource, parent: int) -> bool:
    """End the trial as Ctrl-C does; False where no trial runs."""
    if not source.running or os.getppid() != parent:
        return False
    os.kill(parent, signal.SIGINT)
    return True
