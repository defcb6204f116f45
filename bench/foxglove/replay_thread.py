"""The stream of a folder beside its page, in a thread: a replay, or what another command records."""

import threading
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path

from slipbench.bench.foxglove.server import Server
from slipbench.bench.foxglove.streams import NOTHING_SKIPPED, LiveStream, ReplayStream, run_stream
from slipbench.bench.loop.clock import MonotonicClock
from slipbench.bench.view.access import Address
from slipbench.bench.view.live_run import LiveView
from slipbench.bench.view.replay_run import ReplayRun

ENDING = 5.0  # s that the thread has to end
OFFER = "foxglove: open {url} in Foxglove, Lichtblick or PlotJuggler"
FOLLOWS = "foxglove: follows the newest run from now on; for a replay give the folder of a run"


@contextmanager
def folder_stream(
    folder: Path, replayed: bool, address: Address | None, say: Callable[[str], None]
) -> Iterator[None]:
    """Serve the stream of a folder until the block ends; None: no stream.

    replayed  whether it is a run that has ended
    say       receives lines for people

    Raises InputError where the extra is missing, the port cannot be used, or the run not be replayed.
    """
    if address is None:
        yield
        return
    clock = MonotonicClock()
    if not replayed:
        with closing_server(Server(folder.name, address)) as server:
            say(OFFER.format(url=server.url))
            say(FOLLOWS)
            stream = LiveStream(server, LiveView(folder, clock, NOTHING_SKIPPED), clock)
            with _running(stream.step, server):
                yield
        return
    with (
        closing(ReplayRun(folder, clock)) as run,
        closing_server(Server(folder.name, address, run.bounds)) as server,
    ):
        say(OFFER.format(url=server.url))
        with _running(ReplayStream(server, run, clock).step, server):
            yield


@contextmanager
def closing_server(server: Server) -> Iterator[Server]:
    """Stop a server at the end of the block."""
    try:
        yield server
    finally:
        server.stop()


@contextmanager
def _running(step: Callable[[], None], server: Server) -> Iterator[None]:
    """Take steps in a thread until the block ends."""
    stop = threading.Event()
    thread = threading.Thread(
        target=run_stream, args=(step, server.warn, MonotonicClock(), stop.wait), daemon=True
    )
    thread.start()
    try:
        yield
    finally:
        stop.set()
        thread.join(ENDING)
