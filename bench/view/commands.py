"""The commands of the view: a run in the browser or in the terminal, recorded or being recorded."""

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
    """Address of the Foxglove stream that was asked for; None: no stream."""
    if port is not None:
        return Address(port=port, chosen=True)
    return Address(port=FOXGLOVE_PORT) if stream else None


def view_address(view: bool, address: str | None) -> Address | None:
    """Address of the view that was asked for; None: no view. Raises InputError."""
    if address is not None:
        return address_of(address)
    return Address() if view else None


def view(
    run: Annotated[Path, typer.Argument(help="Run folder, or folder of a session.", metavar="RUN")],
    view_at: ViewAddress = None,
    foxglove: Foxglove = False,
    foxglove_at: FoxglovePort = None,
) -> None:
    """Replay a run in the browser with play, pause and seek, or follow one that is being recorded.

    A run that has ended is replayed with its own clock, one for each page. A run that is being
    recorded, or the folder of a session, is followed. Nothing can be tripped from here: the pages of
    `trial --view` and `session --view` can. With --foxglove the run is also replayed for Foxglove,
    Lichtblick or PlotJuggler: it plays while one of them has subscribed to a topic.

    Exit status: 0 ended with Ctrl-C, 2 invalid input (see message).

    Examples:

      slipbench view runs/throttle_sweep-1

      slipbench view runs/throttle_sweep-1 --foxglove
    """
    from slipbench.bench.foxglove.replay_thread import folder_stream
    from slipbench.bench.view.view_folder import serve_folder

    stream = foxglove_address(foxglove, foxglove_at)
    serve_folder(
        run,
        view_address(True, view_at) or Address(),
        typer.echo,
        lambda folder, replayed: folder_stream(folder, replayed, stream, typer.echo),
    )


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
