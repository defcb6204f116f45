"""The sub-command of this package: `slipbench prove`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

EXAMPLE = (
    "Example: slipbench prove --cases 200 --seed 1 --workers 2 --page docs/blind_validation.md"
)


def register(app: typer.Typer) -> None:
    """Add `prove` to the one command."""
    app.command("prove", epilog=EXAMPLE)(prove_command)


def prove_command(
    cases: Annotated[int, typer.Option(min=1, help="How many sealed cases; half miss nothing.")],
    seed: Annotated[int, typer.Option(min=0, help="Everything follows from it.")],
    out: Annotated[Path, typer.Option(help="Folder of answers and results.")] = Path("proof"),
    workers: Annotated[
        int | None, typer.Option(min=1, help="Local processes; by default one a processor.")
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a dask cluster that exists, tcp://host:8786.")
    ] = None,
    page_path: Annotated[
        Path | None, typer.Option("--page", help="Write the page here, figures beside it.")
    ] = None,
    score_only: Annotated[
        bool, typer.Option("--score-only", help="Unseal and score what is done; analyse nothing.")
    ] = False,
    observe: Annotated[
        bool,
        typer.Option("--observe-again", help="Judge anew what there was to see; analyse nothing."),
    ] = False,
) -> None:
    """Prove it on sealed cases: draw, seal, analyse, unseal, score.

    Interrupted, the same command goes on where it stopped.
    """
    from slipbench.identification.cluster import Workers
    from slipbench.studies.blind_validation.publish import publish
    from slipbench.studies.blind_validation.study import (
        Study,
        observe_again,
        results_so_far,
        run_study,
    )

    console = Console(stderr=True)
    study = Study(cases, seed, out, Workers(workers, scheduler))
    if score_only:
        results = results_so_far(study)
    else:
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
        )
        with Progress(*columns, console=console) as progress:
            task = progress.add_task("sealed cases", total=cases)
            try:
                work = observe_again if observe else run_study
                results = work(
                    study, lambda done, of: progress.update(task, completed=done, total=of)
                )
            except KeyboardInterrupt:
                console.print("interrupted; the same command goes on where this one stopped")
                raise typer.Exit(130) from None
    for line in publish(study, results, page_path or out / "blind_validation.md"):
        typer.echo(line)
