"""The sub-command of this package: `slipbench prove`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

FAILED = 3  # exit status when an analysis failed
EXAMPLE = (
    "Example: slipbench prove --cases 200 --seed 1 --workers 2 --page docs/blind_validation.md"
)


def register(app: typer.Typer) -> None:
    """Add `prove` to the one command."""
    app.command("prove", epilog=EXAMPLE)(prove_command)


def prove_command(
    cases: Annotated[
        int, typer.Option(min=1, help="Number of hidden cases; in half of them nothing is missing.")
    ],
    seed: Annotated[int, typer.Option(min=0, help="Random seed of the study.")],
    out: Annotated[Path, typer.Option(help="Folder for ground truth and results.")] = Path(
        "validation"
    ),
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="Number of local processes; default: one per processor."),
    ] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="Address of a running dask cluster, tcp://host:8786.")
    ] = None,
    page_path: Annotated[
        Path | None,
        typer.Option("--page", help="Page to write (Markdown); figures go to its folder."),
    ] = None,
    score_only: Annotated[
        bool, typer.Option("--score-only", help="Score the existing results; run no analysis.")
    ] = False,
    observe: Annotated[
        bool,
        typer.Option(
            "--observe-again", help="Recompute the ideal observer for all results; run no analysis."
        ),
    ] = False,
) -> None:
    """Blind validation: generate hidden cases, analyse, score.

    After an interruption the same command continues the study. Where an analysis failed, the page is
    written all the same.

    Exit status: 0 all analysed, 2 invalid input (see message), 3 an analysis failed, 130 interrupted.
    """
    from slipbench.identification.cluster import Workers
    from slipbench.protocol.output_folders import check_page
    from slipbench.studies.blind_validation.publish import publish
    from slipbench.studies.blind_validation.study import (
        Study,
        observe_again,
        results_so_far,
        run_study,
    )

    page = page_path or out / "blind_validation.md"
    check_page(page)
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
            task = progress.add_task("hidden cases", total=cases)
            try:
                work = observe_again if observe else run_study
                results = work(
                    study, lambda done, of: progress.update(task, completed=done, total=of)
                )
            except KeyboardInterrupt:
                console.print("interrupted; the same command continues the study")
                raise typer.Exit(130) from None
    for line in publish(study, results, page):
        typer.echo(line)
    failures = [f"case {r['case']}: {r['failed']}" for r in results if "failed" in r]
    for line in failures:
        typer.echo(f"analysis failed: {line}", err=True)
    if failures:
        raise typer.Exit(FAILED)
