"""The options of every command with a view, and the command `watch`: a run in the terminal."""

from pathlib import Path
from typing import Annotated

import typer

from slipbench.bench.view.access import LARGEST_PORT, Address, address_of

FOXGLOVE_PORT = 8765  # which the applications propose

View = Annotated[
    bool, typer.Option("--view", help="Serve a live view; open its printed address in a browser.")
]
ViewAddress = Annotated[
    str | None,
    typer.Option(
        "--view-address",
        help="Address of the live view, HOST:PORT. Another machine needs the printed token."
        "  [default: 127.0.0.1:8470]",
        metavar="HOST:PORT",
    ),
]

Foxglove = Annotated[
    bool,
    typer.Option(
        "--foxglove", help="Stream to Foxglove, Lichtblick or PlotJuggler on this machine."
    ),
]
FoxglovePort = Annotated[
    int | None,
    typer.Option(
        "--foxglove-port",
        help="Port of the Foxglove stream.  [default: 8765, or the next free one]",
        min=0,
        max=LARGEST_PORT,
    ),
]


def foxglove_address(stream: bool, port: int | None) -> Address | None:
    """Address of the requested Foxglove stream; None: no stream."""
    if port is not None:
        return Address(port=port, chosen=True)
    return Address(port=FOXGLOVE_PORT) if stream else None


def view_address(view: bool, address: str | None) -> Address | None:
    """Address of the requested view; None: no view. Raises InputError."""
    if address is not None:
        return address_of(address)
    return Address() if view else None


def watch(
    run: Annotated[Path, typer.Argument(help="Run folder, or folder of a session.", metavar="RUN")],
) -> None:
    """Show a run in the terminal: phase, what is missing to arm, numbers, limits in use.

    A run that is being recorded, or the folder of a session, is followed; give the folder to which
    `trial` or `session` writes. A run that has ended is replayed: space pauses, the arrows seek by
    5 s. It shows, and can do nothing: Ctrl-C belongs to the terminal of the trial. q ends it.

    Exit status: 0 ended with q, 2 invalid input (see message).

    Example: slipbench watch runs/throttle_sweep-1
    """
    from slipbench.bench.view.view_folder import watch_folder

    watch_folder(run)


def register(app: typer.Typer) -> None:
    """Add `watch` to the application; `view` joins the identification as well."""
    app.command()(watch)
