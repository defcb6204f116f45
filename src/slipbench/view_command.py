"""The command `view`: a run, a session, or the runs of a season. It joins the bench and the identification."""

from pathlib import Path
from typing import Annotated

import typer

from slipbench.bench.view.access import Address
from slipbench.bench.view.commands import (
    Foxglove,
    FoxglovePort,
    ViewAddress,
    foxglove_address,
    view_address,
)
from slipbench.protocol.errors import InputError


def register(app: typer.Typer) -> None:
    """Add `view` to the one command."""
    app.command()(view)


def view(
    folder: Annotated[
        Path,
        typer.Argument(
            help="Run folder, folder of a session, or a folder with sessions and runs in it.",
            metavar="FOLDER",
        ),
    ],
    season: Annotated[
        bool,
        typer.Option(
            "--season", help="List the runs below the folder, also where it is that of a session."
        ),
    ] = False,
    view_at: ViewAddress = None,
    foxglove: Foxglove = False,
    foxglove_at: FoxglovePort = None,
) -> None:
    """Replay a run in the browser, follow one that is being recorded, or look through a season.

    A run that has ended is replayed with its own clock, one for each page: play, pause, seek. A run
    that is being recorded, or the folder of a session, is followed. Nothing can be tripped from here:
    the pages of `trial --view` and `session --view` can. With --foxglove the run is also replayed for
    Foxglove, Lichtblick or PlotJuggler: it plays while one of them has subscribed to a topic.

    A folder with sessions and runs in it is a season: a table of runs with filter and order, two runs
    side by side, trends of parameters, as `slipbench runs` prints them.

    Exit status: 0 ended with Ctrl-C, 2 invalid input (see message).

    Examples:

      slipbench view runs/throttle_sweep-1

      slipbench view runs/throttle_sweep-1 --foxglove

      slipbench view season
    """
    address, stream = (
        view_address(True, view_at) or Address(),
        foxglove_address(foxglove, foxglove_at),
    )
    if season or is_season(folder):
        _check_not_streamed(stream)
        _serve_season(folder, address)
        return
    from slipbench.bench.foxglove.replay_thread import folder_stream
    from slipbench.bench.view.view_folder import serve_folder

    serve_folder(
        folder,
        address,
        typer.echo,
        lambda found, replayed: folder_stream(found, replayed, stream, typer.echo),
    )


def is_season(folder: Path) -> bool:
    """Whether a folder is neither a run nor a session, and has runs below it."""
    from slipbench.bench.view.run_list import RUNS
    from slipbench.identification.season.folders import folders
    from slipbench.protocol.recording.run_folder import DESCRIPTION

    if not folder.is_dir() or (folder / DESCRIPTION).exists() or (folder / RUNS).is_dir():
        return False
    return bool(folders(folder))


def _check_not_streamed(stream: Address | None) -> None:
    if stream is not None:
        raise InputError(
            "a season cannot be streamed",
            where="--foxglove",
            remedy="name one run: slipbench view RUN --foxglove",
        )


def _serve_season(folder: Path, address: Address) -> None:
    from slipbench.bench.view.table_server import serve_tables
    from slipbench.bench.view.web import require_web
    from slipbench.identification.season.answers import SeasonAnswers

    require_web()
    serve_tables(SeasonAnswers(folder).by_name, "season", address, typer.echo)
