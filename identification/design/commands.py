"""The sub-command of this package: design."""

from pathlib import Path as File
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

if TYPE_CHECKING:  # the analyses take seconds to import; --help should not
    from slipbench.identification.design.widest import Designed

EXAMPLE = (
    "Example: slipbench design runs/throttle_sweep-001 runs/spark_sweep-001 --actuator mixed "
    "--out mixed.toml"
)


def register(app: typer.Typer) -> None:
    """Add `design` to the one command."""
    app.command("design", epilog=EXAMPLE)(design_command)


def design_command(
    runs: Annotated[
        list[File], typer.Argument(help="Run folders; the first is the nominal operating point.")
    ],
    actuator: Annotated[str, typer.Option(help="Actuator: throttle, spark or mixed.")],
    out: Annotated[File, typer.Option(help="Controller file to write (TOML).")],
    law: Annotated[
        str,
        typer.Option(
            help="Control law: pid, internal_model, best (the better of the two) or h_infinity (needs slycot)."
        ),
    ] = "best",
    report: Annotated[
        File | None,
        typer.Option(help="Folder for the report: Nyquist plot, margins, step responses."),
    ] = None,
    gain_margin: Annotated[float, typer.Option(help="Minimum gain margin, dB.", min=0.0)] = 6.0,
    phase_margin: Annotated[float, typer.Option(help="Minimum phase margin, deg.", min=0.0)] = 40.0,
    sensitivity: Annotated[
        float, typer.Option(help="Maximum sensitivity peak M_s.", min=1.01)
    ] = 2.0,
    period: Annotated[
        float, typer.Option(help="Sample time of the controller, ms.", min=0.1)
    ] = 1.0,
    schedule: Annotated[
        bool,
        typer.Option(
            "--schedule", help="Gain-scheduled PID: one set of gains for the speed of each run."
        ),
    ] = False,
) -> None:
    """Design a slip controller from recorded trials: maximum bandwidth within the stated margins.

    All runs of one actuator form the uncertainty set: the loop is stable, with the stated margins, for each of them.
    """
    from slipbench.identification.design.controller_design import (
        Specification,
        design_controller,
        required_margins,
    )
    from slipbench.identification.design.report import write_report
    from slipbench.identification.response.from_folder import identified_folder
    from slipbench.protocol.controller_file import write_controller

    required = required_margins(gain_margin, phase_margin, sensitivity)
    specification = Specification(actuator, required, law, period * 1e-3, schedule)
    specification.check()
    page = None
    with Console(stderr=True).status("") as progress:
        progress.update("identifying")
        identified = [identified_folder(run) for run in runs]
        progress.update("designing")
        found = design_controller(identified, specification)
        write_controller(found.file, out)
        if report:
            page = write_report(found.path, found.designed, report, found.alternatives())
    for name in _listed(found.designed):
        m = found.designed.margins[name]
        typer.echo(_line(name, m.bandwidth, m.gain, m.phase, m.sensitivity))
    bandwidth = found.file.designed["bandwidth_hz"]
    typer.echo(f"tracking bandwidth of slip: {bandwidth:.1f} Hz (-3 dB)")
    typer.echo(f"controller: {out}")
    if page:
        typer.echo(f"report: {page}")


def _listed(designed: "Designed") -> list[str]:
    """Names of the loops to print: nominal and up to eight others, else the one of highest M_s."""
    others = [name for name in designed.margins if name != "nominal"]
    worst = sorted(others, key=lambda name: -designed.margins[name].sensitivity)
    return ["nominal", *(others if len(others) <= 8 else worst[:1])]


def _line(name: str, bandwidth: float, gain: float, phase: float, peak: float) -> str:
    from math import degrees, isfinite, log10

    bound = f"bandwidth {bandwidth:.1f} Hz" if isfinite(bandwidth) else "above the measured band"
    return (
        f"{name}: {bound} (|T|), gain margin {20 * log10(gain):.1f} dB, "
        f"phase margin {degrees(phase):.0f} deg, M_s {peak:.2f}"
    )
