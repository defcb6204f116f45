"""The sub-command of this package: `slipbench explain`."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from slipbench.protocol.errors import InputError
from slipbench.protocol.shipped_files import completion_of, file_of

if TYPE_CHECKING:
    from slipbench.identification.mismatch.analysis import Analysis
    from slipbench.identification.mismatch.predictive_check.order import Order
    from slipbench.identification.mismatch.reporting.check_result import Check
    from slipbench.identification.mismatch.reporting.verdict import Verdict

EXAMPLE = (
    "Example: slipbench explain --vehicle vehicle.toml runs/sweep runs/square --held-out runs/other"
)
FAILED = 1
INTERRUPTED = 130  # exit status of shells after Ctrl-C


def register(app: typer.Typer) -> None:
    """Add `explain` to the one command."""
    app.command("explain", epilog=EXAMPLE)(explain_command)


def explain_command(
    training: Annotated[
        list[Path],
        typer.Argument(
            help="Training runs: run folders, or tables whose titles state units; run@0:60 is a segment,"
            " in s. An FMU in the first place is the simulation.",
            metavar="[FMU] RUN...",
        ),
    ],
    vehicle: Annotated[
        Path | None,
        typer.Option(
            "--vehicle",
            "--model",
            help="Vehicle file, model file or FMU of the nominal simulation.",
            metavar="FILE",
            parser=file_of("vehicle", "model"),
            autocompletion=completion_of("vehicle", "model"),
        ),
    ] = None,
    held_out: Annotated[
        list[Path] | None, typer.Option(help="Held-out run folder for validation; repeatable.")
    ] = None,
    json_path: Annotated[
        Path | None, typer.Option("--json", help="Write verdict.json to this file.")
    ] = None,
    report_folder: Annotated[
        Path | None, typer.Option("--report", help="Write a memo with figures into this folder.")
    ] = None,
    check: Annotated[
        bool,
        typer.Option(
            "--check", help="Simulate the recordings from the result, and analyse them again."
        ),
    ] = False,
    check_count: Annotated[
        int | None,
        typer.Option(
            min=1, help="Simulated sets with effects, and as many without: 10 by default."
        ),
    ] = None,
    check_minutes: Annotated[
        float | None,
        typer.Option(min=0.0, help="Time limit of --check; twice the expected time by default."),
    ] = None,
    check_seed: Annotated[int | None, typer.Option(min=0, help="Seed of --check.")] = None,
) -> None:
    """Localize and identify the mismatch between simulation and recordings.

    Calibrates the nominal parameters, tests the residual, selects the missing effects and validates
    them on held-out runs. Writes vehicle.improved.toml beside the vehicle file. Ctrl-C ends the
    analysis and writes the results so far. An FMU needs a file beside it: model.toml for model.fmu.

    --check measures how repeatable the result is: it simulates the recordings from the accepted
    model, analyses them again and reports how often the answer is the same. The expected time and
    the time limit are printed first. Ctrl-C ends it and keeps what was done.

    Exit status: 0 done, 1 a step failed, 2 invalid input (see message), 130 interrupted.
    """
    from slipbench.identification.mismatch.explain import run_analysis
    from slipbench.identification.mismatch.predictive_check.order import COUNT, SEED, Order
    from slipbench.identification.mismatch.predictive_check.stopwatch import seconds
    from slipbench.identification.mismatch.reporting.check_in_words import check_lines
    from slipbench.identification.mismatch.reporting.conclude import verdict
    from slipbench.identification.mismatch.reporting.memo import lines
    from slipbench.identification.mismatch.reporting.memo_page import NOT_IN_THE_FILE, in_the_file
    from slipbench.identification.mismatch.reporting.output import (
        prepare_places,
        with_training,
        write_outputs,
    )
    from slipbench.identification.mismatch.runs import open_analysis

    console = Console(stderr=True)
    _reject_without_check(check, count=check_count, minutes=check_minutes, seed=check_seed)
    vehicle, training = _simulation(vehicle, training)
    with console.status("Reading recordings") as progress:
        analysis = open_analysis(vehicle, training, held_out or [])
        _print_notes(analysis, console)
        prepare_places(json_path, report_folder)  # after the input, which may be invalid

        def show_progress(message: str) -> None:
            progress.update(message)
            if not console.is_terminal:
                console.print(message)

        started = seconds()
        if not run_analysis(analysis, show_progress) and not analysis.failure:
            console.print("Interrupted: writing the results so far. Ctrl-C again discards them.")
        elapsed = seconds() - started
    result = verdict(analysis)
    if json_path is not None:
        result = with_training(result, training, json_path.parent)
    for line in lines(result):
        typer.echo(line)
    if check and result.complete:
        write_outputs(analysis, result, vehicle, json_path, report_folder)  # the check takes long
        order = Order(check_count or COUNT, SEED if check_seed is None else check_seed)
        result = replace(result, check=_run_check(analysis, result, order, elapsed, check_minutes))
        for line in check_lines(result):
            typer.echo(line)
    for path in write_outputs(analysis, result, vehicle, json_path, report_folder):
        _print_written(path)
    if not in_the_file(analysis):
        typer.echo(f"the free curve {NOT_IN_THE_FILE}")
    _exit(analysis.failure, result.complete)


def _print_written(path: Path) -> None:
    from slipbench.identification.mismatch.callables.fmu.fmu_file import is_of_an_fmu
    from slipbench.identification.mismatch.reporting.output import IMPROVED

    typer.echo(f"written: {path}")
    if path.name.endswith(IMPROVED) and is_of_an_fmu(path):
        typer.echo(f"as an FMU: slipbench export-fmu {path} --out {path.with_suffix('.fmu')}")


def _print_notes(analysis: "Analysis", console: Console) -> None:
    for note in analysis.system.notes:
        console.print(f"note: {note}", markup=False, soft_wrap=True)


def _exit(failure: str, complete: bool) -> None:
    """Exit with status 1 after a failed analysis, 130 after an interrupted one."""
    if failure:
        Console(stderr=True).print(f"slipbench: the analysis failed in {failure}", markup=False)
        raise typer.Exit(FAILED)
    if not complete:
        raise typer.Exit(INTERRUPTED)


def _run_check(
    analysis: "Analysis", result: "Verdict", order: "Order", elapsed: float, minutes: float | None
) -> "Check":
    """Return the result of the check. elapsed: wall time of the analysis, s."""
    from slipbench.identification.mismatch.predictive_check.check import analyses_of, check
    from slipbench.identification.mismatch.predictive_check.stopwatch import duration, limit_of

    console = Console(stderr=True)
    analysis_count = analyses_of(analysis, order.count)
    limit = limit_of(analysis_count * elapsed, minutes)
    console.print(
        f"Check: {analysis_count} analyses of simulated recordings, seed {order.seed}; expected time"
        f" {duration(analysis_count * elapsed)}, time limit {duration(limit)}. Ctrl-C ends it."
    )
    with console.status("Check") as progress:

        def show_progress(message: str) -> None:
            progress.update(message)
            if not console.is_terminal and ": " not in message:  # one line per analysis
                console.print(message)

        return check(analysis, result, replace(order, limit=limit), show_progress)


def _reject_without_check(check: bool, **given: float | None) -> None:
    """Raise InputError if an option of --check is given without --check."""
    unused = [f"--check-{name}" for name, value in given.items() if value is not None]
    if unused and not check:
        raise InputError(
            f"{', '.join(unused)} has no effect without --check",
            expected="--check",
            remedy="add --check, or leave the option out",
        )


def _simulation(vehicle: Path | None, training: list[Path]) -> tuple[Path, list[Path]]:
    """Return the file of the simulation and the training runs. Raises InputError."""
    if vehicle is not None:
        return vehicle, training
    if training[0].suffix.lower() == ".fmu":
        if training[1:]:
            return training[0], training[1:]
        raise InputError("no run is given", expected="slipbench explain model.fmu RUN...")
    raise InputError(
        "no simulation is given",
        expected="--vehicle FILE, or an FMU before the runs",
        remedy=EXAMPLE.removeprefix("Example: "),
    )
