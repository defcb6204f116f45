"""Process of the live view: it serves the page beside a trial, and ends with the command."""

import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from slipbench.bench.loop.clock import MonotonicClock
from slipbench.bench.view.access import Access, Address
from slipbench.bench.view.live_run import LiveView
from slipbench.bench.view.server import application
from slipbench.bench.view.side_process import begin_beside, side_process
from slipbench.bench.view.sources import LiveSource
from slipbench.bench.view.web import listen, require_web, run_server, urls
from slipbench.protocol.errors import InputError

LOOKING = 30.0  # s that the quick look may take after the end
LAST_UPDATES = 0.3  # s, so that the pages get the last state
GLANCE, GLANCES = 0.05, 40  # s between two looks whether they have it, and their number


@dataclass(frozen=True)
class ViewOrder:
    """Parameters of the process. take_look: nobody else takes the quick look of the run."""

    root: Path
    address: Address
    parent: int
    take_look: bool


def live_view(
    root: Path, address: Address | None, say: Callable[[str], None], *, take_look: bool
) -> AbstractContextManager[None]:
    """Serve the view of what is recorded below `root` until the block ends; None: no view.

    say: receives lines for people, with the address to open. Raises InputError where the extra is
    missing; entering raises it where the address cannot be used.
    """
    if address is None:
        return nullcontext()
    require_web()
    order = ViewOrder(root.absolute(), address, os.getpid(), take_look)
    return side_process("live view", serve, order, say, LOOKING)


def serve(order: ViewOrder, pipe: Connection) -> None:
    """Serve the page until the command says that it ends, or has ended: main function of the process."""
    begin_beside()
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
        if source.up_to_date:
            break
        pause.wait(GLANCE)
    pause.wait(LAST_UPDATES)  # what was sent last is under way


def trip(source: LiveSource, parent: int) -> bool:
    """End the trial as Ctrl-C does; False where no trial runs."""
    if not source.running or os.getppid() != parent:
        return False
    os.kill(parent, signal.SIGINT)
    return True
