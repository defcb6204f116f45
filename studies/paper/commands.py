"""The sub-command of this package: `slipbench paper`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from slipbench.examples import TRIALS
from slipbench.plant.vehicles import NOMINAL

EXAMPLE = "Example: slipbench paper --out paper --runs paper/runs"
FAILED = 3  # exit status where a claim does not hold


def register(app: typer.Typer) -> None:
    """Add `paper` to the one command."""
    app.command("paper", epilog=EXAMPLE)(paper_command)


def paper_command(
    out: Annotated[Path, typer.Option(help="Folder for paper.html, claims.json and figures.")],
    runs: Annotated[
        Path | None,
        typer.Option(help="Folder of the recordings; missing ones are recorded into it."),
    ] = None,
    nominal: Annotated[
        Path, typer.Option(help="Vehicle file with the nominal parameters.")
    ] = NOMINAL,
    trials: Annotated[Path, typer.Option(help="Folder of the trial files.")] = TRIALS,
    bandwidth: Annotated[
        float, typer.Option(help="Bandwidth w_c of the throttle servo, Hz.", min=0.1)
    ] = 10.0,
    document: Annotated[
        Path | None,
        typer.Option(help="Markdown page to write in addition; figures go to its folder."),
    ] = None,
) -> None:
    """Reproduce the paper of Corno and Savaresi (SYSID 2009) on CAN recordings, claim by claim.

    Trials whose recordings are not in --runs are run first, on the virtual motorcycle.

    Exit status: 0 every claim holds, 2 invalid input (see message), 3 a claim does not hold.
    """
    from slipbench.protocol.output_folders import check_page
    from slipbench.studies.paper.paper_command import reproduce
    from slipbench.studies.paper.paper_report import found_in_words

    if document is not None:
        check_page(document)
    console = Console(stderr=True)
    with console.status("") as progress:
        done = reproduce(
            out, runs or out / "runs", nominal, trials, bandwidth, progress.update, document
        )
    for claim in done.claims:
        mark = "holds" if claim.holds else "FAILS"
        typer.echo(f"  {mark}  {claim.statement}: {found_in_words(claim)}")
    typer.echo(f"\n{done.answer}\n\nreport: {done.page}")
    if not all(claim.holds for claim in done.claims):
        raise typer.Exit(FAILED)
