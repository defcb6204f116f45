"""The sub-commands of this package: identify, model and explain."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from slipbench.identification.mismatch import commands as explain_commands
from slipbench.protocol.errors import InputError

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
    run: Annotated[Path, typer.Argument(help="Run folder: of a trial or of an imported log.")],
    out: Annotated[
        Path | None, typer.Option(help="Where to write the report; by default the run folder.")
    ] = None,
    figures: Annotated[
        Path | None, typer.Option(help="Also write every figure as PNG into this folder.")
    ] = None,
) -> None:
    """Identify a recording: slip, its response to throttle or spark, and a report.

    Writes report.html, which needs nothing but a browser, and identification.json.
    """
    from slipbench.identification.response.from_folder import identified
    from slipbench.protocol.recording.run_folder import read

    console = Console(stderr=True)
    with console.status("") as progress:
        progress.update("reading the recording")
        recording = read(run)
        progress.update("identifying")
        found = identified(recording)
        progress.update("modelling")
        study = studied(found)
        progress.update("drawing")
        written = write_report(found, study, out or run, figures)
    for line in summary(found, study):
        typer.echo(line)
    typer.echo(f"report: {written}")


def model_command(
    tables: Annotated[
        list[Path], typer.Argument(metavar="TABLE...", help="Runs to fit; each begins at rest.")
    ],
    input: Annotated[str, typer.Option(help="Column of the input.")],
    output: Annotated[str, typer.Option(help="Column of the output.")],
    out: Annotated[Path, typer.Option(help="Where to write model.html and model.json.")],
    held_out: Annotated[
        list[Path] | None, typer.Option(help="A run to predict; may be repeated.")
    ] = None,
) -> None:
    """Model any input and output that were recorded in tables, and predict runs it has not seen.

    Frequency response where at least three runs repeat one excitation, a rational model with delay
    either way. TABLE: CSV, columns of text, Parquet or MF4, with a column of time.
    """
    from slipbench.identification.models.table_study import read_run as read_columns
    from slipbench.identification.models.table_study import table_study
    from slipbench.identification.report.table_report import figures, headline, page, rows

    console = Console(stderr=True)
    with console.status("reading") as progress:
        runs = [read_columns(path, input, output) for path in tables]
        unseen = [read_columns(path, input, output) for path in held_out or []]
        progress.update("modelling")
        study = table_study(runs, unseen, (input.strip("$\\"), output.strip("$\\")))
        progress.update("drawing")
        made = {"model.html": page(study), "model.json": _json(figures(study))}
    path = _written(out, made)
    typer.echo(headline(study))
    for name, role, fit, error in rows(study):
        typer.echo(f"  {name:<22} {role:<8} fit {fit:>7}   rms error {error}")
    typer.echo(f"report: {path}")


def _json(tree: object) -> str:
    return json.dumps(_plain(tree), indent=2, allow_nan=False) + "\n"


def _written(out: Path, made: dict[str, str]) -> Path:
    """Write files into a folder and give the first one's path. Raises InputError."""
    try:
        out.mkdir(parents=True, exist_ok=True)
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
    """Model what was identified."""
    from slipbench.identification.models.study import study_of

    return study_of(found)


def write_report(found: "Identification", study: "Study", out: Path, figures: Path | None) -> Path:
    """Write report.html, identification.json and, if asked, the figures. Raises InputError."""
    from slipbench.identification.report.key_figures import key_figures
    from slipbench.identification.report.report import draw, report, write_figures

    drawn = draw(found, study)
    try:
        out.mkdir(parents=True, exist_ok=True)
        numbers = json.dumps(_plain(key_figures(found, study)), indent=2, allow_nan=False)
        (out / "identification.json").write_text(numbers + "\n", encoding="utf-8")
        path = out / "report.html"
        path.write_text(report(found, study, drawn), encoding="utf-8")
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
    """Give the key figures as lines for a terminal, each with what it stands on."""
    from slipbench.identification.report.headline import headline
    from slipbench.identification.report.tiles import tiles

    lines = [headline(found), ""]
    lines += [f"  {t.label:<22} {t.value:<15} {t.note}" for t in tiles(found, study)]
    left = [f"  left out: {item}" for item in (*found.left_out, *study.left_out)]
    return [*lines, *left, ""]


def _plain(tree: object) -> object:
    """Turn what is not a number into null: JSON has no NaN."""
    if isinstance(tree, dict):
        return {key: _plain(value) for key, value in tree.items()}
    if isinstance(tree, list):
        return [_plain(value) for value in tree]
    return None if isinstance(tree, float) and not abs(tree) < float("inf") else tree
