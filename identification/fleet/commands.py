"""The sub-command of this package: `slipbench explain-fleet`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

EXAMPLE = "Example: slipbench explain-fleet season.toml --out season --scheduler tcp://host:8786"

FAILED = 3  # exit status when an analysis failed


def register(app: typer.Typer) -> None:
    """Add `explain-fleet` to the one command."""
    app.command("explain-fleet", epilog=EXAMPLE)(explain_fleet_command)


def explain_fleet_command(
    fleet: Annotated[Path, typer.Argument(help="Fleet file: vehicles and their run folders.")],
    out: Annotated[Path, typer.Option(help="Folder of all verdicts, memos and the table.")],
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="Number of local processes; default: one per processor."),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(help="Address of a running dask cluster that has access to the same folders."),
    ] = None,
) -> None:
    """Explain a season or a fleet: `slipbench explain` for every vehicle of a file, side by side.

    A vehicle that already has a verdict is skipped.

    Exit status: 0 all analysed, 2 invalid input (see message), 3 an analysis failed.
    """
    from slipbench.identification.cluster import Workers
    from slipbench.identification.fleet.fleet import TABLE, explain_fleet
    from slipbench.identification.fleet.fleet_file import read_fleet

    entries = read_fleet(fleet)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=Console(stderr=True)) as progress:
        task = progress.add_task("analyses", total=len(entries))
        rows = explain_fleet(
            entries,
            out,
            Workers(workers, scheduler),
            lambda done, _: progress.update(task, completed=done),
        )
    for row in rows:
        typer.echo(f"{row['name']}: {row.get('sentence') or row.get('trouble')}")
    typer.echo(f"written: {out / TABLE}")
    if any("trouble" in row for row in rows):
        raise typer.Exit(FAILED)
