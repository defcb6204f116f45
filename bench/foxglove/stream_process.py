"""Process of the Foxglove stream beside a trial: it ends with the command."""

import threading
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext, suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from slipbench.bench.foxglove.replay_thread import OFFER, closing_server
from slipbench.bench.foxglove.server import Server, require_foxglove
from slipbench.bench.foxglove.streams import NOTHING_SKIPPED, LiveStream, run_stream
from slipbench.bench.loop.clock import SECOND, Clock, MonotonicClock
from slipbench.bench.view.access import Address
from slipbench.bench.view.live_run import LiveView
from slipbench.bench.view.side_process import begin_beside, side_process
from slipbench.protocol.errors import InputError

CATCHING_UP = 20.0  # s after the end of a trial in which a stream that lags sends the remainder
LAST_MESSAGES = 1.0  # s, so that clients get what was sent last


@dataclass(frozen=True)
class StreamOrder:
    """Parameters of the process. root: folder of a session, or run folder, which need not exist yet."""

    root: Path
    address: Address


def live_stream(
    root: Path, address: Address | None, say: Callable[[str], None]
) -> AbstractContextManager[None]:
    """Stream what is recorded below `root` until the block ends; None: no stream.

    say: receives lines for people, with the address to open. Entering raises InputError where the
    port cannot be used; InputError where the extra is missing.
    """
    if address is None:
        return nullcontext()
    require_foxglove()
    order = StreamOrder(root.absolute(), address)
    ending = CATCHING_UP + LAST_MESSAGES
    return side_process("Foxglove stream", serve, order, say, ending)


def serve(order: StreamOrder, pipe: Connection) -> None:
    """Stream until the command says that it ends, or has ended: main function of the process."""
    begin_beside()
    try:
        server = Server(order.root.name, order.address)
    except InputError as fault:
        pipe.send(fault)
        return
    clock = MonotonicClock()
    with closing_server(server):
        stream = LiveStream(server, LiveView(order.root, clock, NOTHING_SKIPPED), clock)
        pipe.send([OFFER.format(url=server.url)])
        run_stream(stream.step, server.warn, clock, pipe.poll)
        with suppress(EOFError, OSError):  # the command was killed
            pipe.recv()
            _finish(stream, server, clock)


def _finish(stream: LiveStream, server: Server, clock: Clock) -> None:
    """Send the remainder of the recording while a client waits for it."""
    pause, until = threading.Event(), clock.now_ns() + round(CATCHING_UP * SECOND)

    def has_clients() -> bool:
        return server.subscribed or stream.waits_for_clients

    def ends(seconds: float) -> bool:
        pause.wait(seconds)
        return stream.complete or not has_clients() or clock.now_ns() > until

    run_stream(stream.step, server.warn, clock, ends)
    if server.subscribed:
        if not stream.complete:
            server.warn("the stream ends before the end of the recording, which has all messages")
        pause.wait(LAST_MESSAGES)
