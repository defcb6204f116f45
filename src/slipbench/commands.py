"""The sub-commands for the installation itself: init, doctor, and --version."""

from importlib.metadata import version
from pathlib import Path
from typing import Annotated

import typer

STYLES = {"ok": "green", "note": "cyan", "warning": "yellow", "error": "red"}
INVALID = 2  # exit status


def register(app: typer.Typer) -> None:
    """Add these commands and --version to the one command."""
    app.callback()(slipbench)
    app.command("init")(init)
    app.command("doctor")(doctor)


def _print_version(asked: bool) -> None:
    if asked:
        typer.echo(f"slipbench {version('slipbench')}")
        raise typer.Exit


def slipbench(
    _version: Annotated[
        bool,
        typer.Option(
            "--version", help="Print the version.", callback=_print_version, is_eager=True
        ),
    ] = False,
) -> None:
    """Excite, record and identify the rear-wheel slip of a motorcycle over CAN."""


def init(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="New or empty folder.")],
) -> None:
    """Write files to start from: trials, vehicle, database, role maps, controllers, models.

    The files are commented and run as they are. A file that exists is never overwritten.

    Exit status: 0 done, 2 invalid input (see message).

    Example: slipbench init my_bike
    """
    from slipbench.init_folder import init_folder

    paths = init_folder(folder)
    typer.echo(f"{len(paths)} files in {folder}; next: cd {folder} && cat README.md")
    typer.echo("then: slipbench trial trials/my_trial.toml")


def doctor() -> None:
    """Check this computer: versions, extras, CAN interfaces, kernel CAN, real-time rights.

    Each line that is not "ok" has a remedy. "note" concerns only those who need it, "warning" a
    trial in real time or on a real bus, "error" every trial. Nothing is changed.

    Exit status: 0 no error, 2 an error.

    Example: slipbench doctor
    """
    from rich.console import Console
    from rich.text import Text

    from slipbench.doctor import checks

    console, failed = Console(highlight=False, soft_wrap=True), False
    for check in checks():
        failed |= check.state == "error"
        line = Text(f"{check.state:8}", style=STYLES[check.state])
        console.print(line.append(f"{check.topic}: {check.found}", style="default"))
        if check.remedy:
            console.print(Text(f"{'':8}  remedy: {check.remedy}"))
    if failed:
        raise typer.Exit(INVALID)
