"""The sub-command of this package: `slipbench explain`."""

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from slipbench.protocol.shipped_files import completion_of, file_of

EXAMPLE = (
    "Example: slipbench explain --vehicle vehicle.toml runs/sweep runs/square --held-out runs/other"
)
INTERRUPTED = 130  # exit status after Ctrl-C, as shells have it


def register(app: typer.Typer) -> None:
    """Add `explain` to the one command."""
    app.command("explain", epilog=EXAMPLE)(explain_command)


def explain_command(
    training: Annotated[
        list[Path], typer.Argument(help="Run folders to learn from; run@0:60 is a piece, in s.")
    ],
    vehicle: Annotated[
        Path,
        typer.Option(
            help="Vehicle file: the simulation as it is believed.",
            metavar="FILE",
            parser=file_of("vehicle", "model"),
            autocompletion=completion_of("vehicle", "model"),
        ),
    ],
    held_out: Annotated[
        list[Path] | None, typer.Option(help="Run folder to prove on; may be given several times.")
    ] = None,
    json_path: Annotated[
        Path | None, typer.Option("--json", help="Write the verdict here.")
    ] = None,
    report_folder: Annotated[
        Path | None, typer.Option("--report", help="Write a memo with figures into this folder.")
    ] = None,
) -> None:
    """Explain where simulation and recordings differ: where, what is missing, how sure.

    Writes vehicle.improved.toml beside the vehicle file. Interrupted, it says what it has so far.
    """
    from slipbench.identification.mismatch.explain import known_so_far
    from slipbench.identification.mismatch.runs import open_analysis
    from slipbench.identification.mismatch.telling.conclude import verdict
    from slipbench.identification.mismatch.telling.memo import lines
    from slipbench.identification.mismatch.telling.memo_page import NOT_IN_THE_FILE, in_the_file
    from slipbench.identification.mismatch.telling.output import prepare_places, write_outputs

    console = Console(stderr=True)
    prepare_places(json_path, report_folder)
    with console.status("reading the recordings") as progress:
        analysis = open_analysis(vehicle, training, held_out or [])

        def say(words: str) -> None:
            progress.update(words)
            if not console.is_terminal:
                console.print(words)

        if not known_so_far(analysis, say):
            console.print("interrupted; press again to stop at once")
    found = verdict(analysis)
    for line in lines(found):
        typer.echo(line)
    for path in write_outputs(analysis, found, vehicle, json_path, report_folder):
        typer.echo(f"written: {path}")
    if not in_the_file(analysis):
        typer.echo(f"the free curve {NOT_IN_THE_FILE}")
    if not found.complete:
        raise typer.Exit(INTERRUPTED)
