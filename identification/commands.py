"""The sub-commands of this package: identify, model and explain."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from slipbench.identification.mismatch import commands as explain_commands
from slipbench.protocol.errors import InputError
from slipbench.protocol.output_folders import make_folders

if TYPE_CHECKING:  # the analyses take seconds to import; --help should not
    from slipbench.identification.models.study import Study
    from slipbench.identification.response.identify import Identification

EXAMPLE = "Example: slipbench identify runs/throttle_sweep --figures figures"
MODEL_EXAMPLE = (
    "Example: slipbench model sweep*.csv --input u --output y --held-out step.csv --out model"
)


def register(app: typer.Typer) -> None:
    """Add `identify`, `model` and `explain` to the one command."""
    app.command("identify", epilog=EXAMPLE)(identify_command)
    app.command("model", epilog=MODEL_EXAMPLE)(model_command)
    explain_commands.register(app)


def identify_command(
    runs: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="Run folder of a trial or of an imported log, or a table whose titles state units.",
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            help="Folder for the report; default: the run folder, for a table its name without ending,"
            " for several runs `comparison`."
        ),
    ] = None,
    figures: Annotated[
        Path | None, typer.Option(help="Folder for every figure as PNG; default: none.")
    ] = None,
    window: Annotated[
        str | None,
        typer.Option(
            metavar="START:END",
            help="Part to identify from, in s after the start (12:42), or START-END in s or mm:ss"
            " (1:05-2:10); default: the excitation of the trial.",
        ),
    ] = None,
    input: Annotated[
        str | None,
        typer.Option(metavar="SIGNAL", help="Input signal; default: the actuator of the trial."),
    ] = None,
    output: Annotated[
        str | None, typer.Option(metavar="SIGNAL", help="Output signal; default: slip.")
    ] = None,
) -> None:
    """Identify a recording: frequency response, parametric model; slip in a trial of a motorcycle.

    Writes report.html (self-contained) and identification.json. With --window, --input and --output
    any recording of any machine can be identified, also one without a trial. Several runs are
    compared: comparison.html and comparison.json have the pooled response and the differences between
    the runs.
    """
    from slipbench.identification.response.from_folder import identified
    from slipbench.identification.response.selection import Selection, parse_window
    from slipbench.protocol.recording.table_recording import read_recording

    selection = Selection(parse_window(window) if window else None, input, output)
    console, made = Console(stderr=True), []
    with console.status("") as progress:
        for run in runs:
            progress.update(f"{run.name}: reading the recording")
            recording = read_recording(run)
            progress.update(f"{run.name}: identifying")
            found = identified(recording, selection)
            progress.update(f"{run.name}: fitting models")
            made.append((found, studied(found)))
        progress.update("drawing figures")
        if len(runs) > 1:
            said, written = write_comparison(made, out or Path("comparison"), figures)
        else:
            said = summary(*made[0])
            own = runs[0] if runs[0].is_dir() else Path(runs[0].stem)
            written = write_report(*made[0], out or own, figures)
    for line in said:
        typer.echo(line)
    typer.echo(f"report: {written}")


def write_comparison(
    runs: "list[tuple[Identification, Study]]", out: Path, figures: Path | None
) -> tuple[list[str], Path]:
    """Lines for a terminal and the path of comparison.html; also writes comparison.json.

    figures: folder for the overlay as PNG. Raises InputError where the runs cannot be compared or a
    file cannot be written.
    """
    from slipbench.identification.session import comparison_page
    from slipbench.identification.session.comparison import compare

    found = compare(runs)
    made = {
        "comparison.html": comparison_page.page(found),
        "comparison.json": _json(comparison_page.figures(found)),
    }
    path = _written(out, made)
    if figures is not None:
        comparison_page.write_figure(found, figures)
    return comparison_page.lines(found), path


def model_command(
    tables: Annotated[
        list[Path], typer.Argument(metavar="TABLE...", help="Training runs; each starts at rest.")
    ],
    input: Annotated[str, typer.Option(help="Name of the input column.")],
    output: Annotated[str, typer.Option(help="Name of the output column.")],
    out: Annotated[Path, typer.Option(help="Folder for model.html and model.json.")],
    held_out: Annotated[
        list[Path] | None, typer.Option(help="Held-out run for validation; may be repeated.")
    ] = None,
) -> None:
    """Fit a transfer function with dead time to tables of one input and one output; validate it.

    With at least three runs of the same excitation also the frequency response. TABLE: CSV, text columns,
    Parquet or MF4, with a time column.
    """
    from slipbench.identification.models.table_study import read_run as read_columns
    from slipbench.identification.models.table_study import table_study
    from slipbench.identification.report.table_report import figures, headline, page, rows

    console = Console(stderr=True)
    with console.status("reading") as progress:
        runs = [read_columns(path, input, output) for path in tables]
        unseen = [read_columns(path, input, output) for path in held_out or []]
        progress.update("fitting models")
        study = table_study(runs, unseen, (input.strip("$\\"), output.strip("$\\")))
        progress.update("drawing figures")
        made = {"model.html": page(study), "model.json": _json(figures(study))}
    path = _written(out, made)
    typer.echo(headline(study))
    for name, role, fit, error in rows(study):
        typer.echo(f"  {name:<22} {role:<8} NRMSE fit {fit:>7}   rms error {error}")
    typer.echo(f"report: {path}")


def _json(tree: object) -> str:
    return json.dumps(_plain(tree), indent=2, allow_nan=False) + "\n"


def _written(out: Path, made: dict[str, str]) -> Path:
    """Path of the first of the files, written into a folder. Raises InputError."""
    try:
        make_folders(out)
        for name, text in made.items():
            (out / name).write_text(text, encoding="utf-8")
    except OSError as fault:
        raise InputError(
            "the report cannot be written",
            where=str(fault.filename or out),
            found=fault.strerror or str(fault),
            remedy="give another folder with --out",
        ) from fault
    return out / next(iter(made))


def studied(found: "Identification") -> "Study":
    """Models of an identified recording."""
    from slipbench.identification.models.study import study_of

    return study_of(found)


def write_report(found: "Identification", study: "Study", out: Path, figures: Path | None) -> Path:
    """Path of report.html; also writes identification.json and, on request, the figures.

    Raises InputError where a file cannot be written.
    """
    from slipbench.identification.report.key_figures import key_figures
    from slipbench.identification.report.report import draw, report, write_figures
    from slipbench.identification.session.run_verdict import run_verdict

    drawn, verdict = draw(found, study), run_verdict(found, study)
    try:
        make_folders(out, *([] if figures is None else [figures]))
        numbers = json.dumps(_plain(key_figures(found, study, verdict)), indent=2, allow_nan=False)
        (out / "identification.json").write_text(numbers + "\n", encoding="utf-8")
        path = out / "report.html"
        path.write_text(report(found, study, drawn, verdict), encoding="utf-8")
        if figures is not None:
            write_figures(drawn, figures)
    except OSError as fault:
        raise InputError(
            "the report cannot be written",
            where=str(fault.filename or out),
            found=fault.strerror or str(fault),
            remedy="give another folder with --out",
        ) from fault
    return path


def summary(found: "Identification", study: "Study") -> list[str]:
    """Key figures as lines for a terminal."""
    from slipbench.identification.report.headline import headline
    from slipbench.identification.report.tiles import tiles
    from slipbench.identification.session.run_verdict import run_verdict

    lines = [headline(found), f"Verdict on the run: {run_verdict(found, study)}.", ""]
    shown = tiles(found, study)
    label = max((len(tile.label) for tile in shown), default=0)
    value = max((len(tile.value) for tile in shown), default=0)
    lines += [f"  {t.label:<{label}}  {t.value:<{value}}  {t.note}".rstrip() for t in shown]
    skipped = [f"  not performed: {item}" for item in (*found.left_out, *study.left_out)]
    warnings = [f"  warning: {text}" for text in found.recording.description.get("warnings", [])]
    return [*lines, *skipped, *warnings, ""]


def _plain(tree: object) -> object:
    """Tree with NaN and infinity replaced by None, because JSON has neither."""
    if isinstance(tree, dict):
        return {key: _plain(value) for key, value in tree.items()}
    if isinstance(tree, list):
        return [_plain(value) for value in tree]
    return None if isinstance(tree, float) and not abs(tree) < float("inf") else tree
