"""The commands of the view: a run in the browser or in the terminal, recorded or being recorded."""

from pathlib import Path
from typing import Annotated

import typer

from slipbench.bench.view.access import Address, address_of

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


def view_address(view: bool, address: str | None) -> Address | None:
    """Address of the view that was asked for; None: no view. Raises InputError."""
    if address is not None:
        return address_of(address)
    return Address() if view else None


def view(
    run: Annotated[Path, typer.Argument(help="Run folder, or folder of a session.", metavar="RUN")],
    view_at: ViewAddress = None,
) -> None:
    """Replay a run in the browser with play, pause and seek, or follow one that is being recorded.

    A run that has ended is replayed with its own clock, one for each page. A run that is being
    recorded, or the folder of a session, is followed. Nothing can be tripped from here: the pages of
    `trial --view` and `session --view` can.

    Exit status: 0 ended with Ctrl-C, 2 invalid input (see message).

    Example: slipbench view runs/throttle_sweep-1
    """
    from slipbench.bench.view.view_folder import serve_folder

    serve_folder(run, view_address(True, view_at) or Address(), typer.echo)


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
    """Add the commands of the view to the application."""
    app.command()(view)
    app.command()(watch)
