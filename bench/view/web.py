"""The web server of the view: its libraries, its socket, its thread, and the addresses to open."""

import asyncio
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from slipbench.bench.view.access import Access, Address
from slipbench.protocol.errors import InputError
from slipbench.protocol.extras import optional_library

if TYPE_CHECKING:
    from starlette.applications import Starlette

LIBRARIES = ("starlette", "uvicorn", "websockets")
ENDING = 2.0  # s that open connections have at the end
PING = 5.0  # s; a page that does not answer for as long is disconnected


def require_web() -> None:
    """Check that the libraries of the view are installed. Raises InputError."""
    for name in LIBRARIES:
        optional_library(name)


def listen(address: Address) -> socket.socket:
    """Socket that listens at an address; at the next free port where the user chose none.

    Raises InputError where the address cannot be used.
    """
    try:
        return _bound(address.host, address.port)
    except OSError as cause:
        if not address.chosen:
            return _bound_anywhere(address, cause)
        raise _unusable(address, cause) from cause


def _bound_anywhere(address: Address, cause: OSError) -> socket.socket:
    try:
        return _bound(address.host, 0)
    except OSError:
        raise _unusable(address, cause) from cause


def _bound(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listening = socket.socket(family, socket.SOCK_STREAM)
    try:
        listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind((host, port))
        listening.listen()
    except OSError:
        listening.close()
        raise
    return listening


def _unusable(address: Address, cause: OSError) -> InputError:
    return InputError(
        "the live view cannot use this address",
        where=f"{address.host}:{address.port}",
        found=str(cause.strerror or cause),
        remedy="give another one with --view-address HOST:PORT",
    )


@contextmanager
def run_server(app: "Starlette", listening: socket.socket) -> Iterator[None]:
    """Serve `app` in a thread until the block ends. The thread leaves the signals to the process."""
    uvicorn = optional_library("uvicorn")
    config = uvicorn.Config(
        app,
        log_level="error",
        access_log=False,
        ws_ping_interval=PING,
        ws_ping_timeout=PING,
        timeout_graceful_shutdown=round(ENDING),
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(
        target=lambda: asyncio.run(server.serve(sockets=[listening])), name="view", daemon=True
    )
    thread.start()
    try:
        yield
    finally:
        server.should_exit = True
        thread.join(2 * ENDING)


def urls(address: Address, port: int, access: Access) -> list[str]:
    """Lines for people: the address to open, with a token where the view needs one."""
    if access.open_to_all:
        return [f"view: http://{_host(address.host)}:{port}/"]
    base = f"http://{_host(_reachable(address.host))}:{port}/?token="
    return [
        f"view, may trip: {base}{access.trip_token}",
        f"view, read-only: {base}{access.read_token}",
    ]


def _host(host: str) -> str:
    return f"[{host}]" if ":" in host else host


def _reachable(host: str) -> str:
    """Name by which other machines reach this one, where it listens at every address."""
    return socket.gethostname() if host in ("0.0.0.0", "::") else host
