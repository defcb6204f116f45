"""The sub-command of this package: design."""

from pathlib import Path as File
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console

from slipbench.protocol.errors import InputError

if TYPE_CHECKING:  # the analyses take seconds to import; --help should not
    from collections.abc import Callable

    from slipbench.identification.design.from_runs import Path
    from slipbench.identification.design.mixed import Mixture
    from slipbench.identification.design.problem import Problem
    from slipbench.identification.design.widest import Designed, NoDesign
    from slipbench.identification.response.identify import Identification

EXAMPLE = (
    "Example: slipbench design runs/throttle_sweep-001 runs/spark_sweep-001 --actuator mixed "
    "--out mixed.toml"
)
ACTUATORS = ("throttle", "spark", "mixed")
LAWS = ("best", "pid", "internal_model", "h_infinity")


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
    from math import radians

    from slipbench.identification.design.problem import Requirements
    from slipbench.identification.design.report import write_report
    from slipbench.identification.design.writing import controller_file, mixed_file
    from slipbench.identification.response.from_folder import identified_folder
    from slipbench.protocol.controller_file import write_controller

    if actuator not in ACTUATORS or law not in LAWS:
        raise InputError(
            f"unknown actuator or control law: {actuator}, {law}",
            expected=", ".join((*ACTUATORS, *LAWS)),
            remedy="choose --actuator and --law from these",
        )
    _check_options(actuator, law, schedule)
    required = Requirements(10 ** (gain_margin / 20), radians(phase_margin), sensitivity)
    with Console(stderr=True).status("") as progress:
        progress.update("identifying")
        found = [identified_folder(run) for run in runs]
        progress.update("designing")
        path = _path("throttle" if actuator == "throttle" else "spark", found, required, period)
        rows = _by_speed(actuator, found, required, period) if schedule else ()
        if actuator == "mixed":
            slow = _path("throttle", found, required, period)
            both = _mixture(slow, path)
            designed, file = both.designed, mixed_file(path, both, slow)
        else:
            designed = rows[0][1] if rows else _designed(path, law)
            file = controller_file(path, designed, tuple((v, d.controller) for v, d in rows))
        write_controller(file, out)
        page = (
            write_report(path, designed, report, _alternatives(path, law, actuator))
            if report
            else None
        )
    for name in _listed(designed):
        m = designed.margins[name]
        typer.echo(_line(name, m.bandwidth, m.gain, m.phase, m.sensitivity))
    typer.echo(f"tracking bandwidth of slip: {file.designed['bandwidth_hz']:.1f} Hz (-3 dB)")
    typer.echo(f"controller: {out}")
    if page:
        typer.echo(f"report: {page}")


def _path(actuator: str, runs: "list[Identification]", required: object, period: float) -> "Path":
    from slipbench.identification.design.from_runs import NoPath, path_of
    from slipbench.identification.design.problem import Requirements

    assert isinstance(required, Requirements)
    path = path_of(actuator, runs, required, period * 1e-3)
    if isinstance(path, NoPath):
        raise InputError(
            f"no controller can be designed for the {actuator}",
            found=path.reason,
            remedy=f"record a trial that excites the {actuator}",
        )
    return path


def _by_speed(
    actuator: str, runs: "list[Identification]", required: object, period: float
) -> "tuple[tuple[float, Designed], ...]":
    """Designs for the speed of each run that excited the actuator, slowest first."""
    from slipbench.identification.design.by_speed import scheduled
    from slipbench.identification.design.from_runs import Path, path_of
    from slipbench.identification.design.problem import Requirements
    from slipbench.identification.design.widest import NoDesign

    assert isinstance(required, Requirements)
    if actuator == "mixed":
        raise InputError(
            "a mixed controller cannot be gain-scheduled",
            found="--schedule --actuator mixed",
            expected="throttle or spark",
            remedy="leave out --schedule",
        )
    paths = [path_of(actuator, [run], required, period * 1e-3) for run in runs]
    found = scheduled([(p.speed, p.problem) for p in paths if isinstance(p, Path)])
    if isinstance(found, NoDesign):
        raise InputError(
            "no gain schedule meets the stability margins",
            found=found.reason,
            remedy="leave out --schedule, or choose other runs",
        )
    return found.designs


def _mixture(slow: "Path", fast: "Path") -> "Mixture":
    from slipbench.identification.design.mixed import mixture
    from slipbench.identification.design.widest import NoDesign

    found = mixture(slow, fast)
    if isinstance(found, NoDesign):
        raise InputError(
            "mixed control has no advantage over the throttle alone",
            found=found.reason,
            remedy="design a controller for the throttle or the spark alone",
        )
    return found


def _laws() -> "dict[str, Callable[[Problem], Designed | NoDesign]]":
    from slipbench.identification.design import widest
    from slipbench.identification.design.h_infinity import h_infinity

    return {
        "best": widest.best,
        "pid": widest.pid,
        "internal_model": widest.internal_model,
        "h_infinity": h_infinity,
    }


def _alternatives(path: "Path", law: str, actuator: str) -> "dict[str, Designed | NoDesign]":
    """Designs with every other control law for the same problem, for comparison in the report."""
    own = "" if actuator == "mixed" else law
    return {
        name: design(path.problem) for name, design in _laws().items() if name not in (own, "best")
    }


def _check_options(actuator: str, law: str, schedule: bool) -> None:
    """Check that the options can be combined and are installed. Raises InputError."""
    from slipbench.identification.design.h_infinity import INSTALL
    from slipbench.identification.design.mixed_sensitivity import available

    if actuator == "mixed" and law not in ("best", "internal_model"):
        raise InputError(
            "mixed control is available with internal models only",
            found=f"--law {law}",
            expected="best or internal_model",
            remedy="leave out --law",
        )
    if schedule and law not in ("best", "pid"):
        raise InputError(
            "gain scheduling is available for PID only",
            found=f"--law {law}",
            expected="best or pid",
            remedy="leave out --law or --schedule",
        )
    if law == "h_infinity" and not available():
        raise InputError(
            "H-infinity design needs SLICOT",
            found="no module slycot",
            remedy=f"{INSTALL}, or choose another --law",
        )


def _designed(path: "Path", law: str) -> "Designed":
    from slipbench.identification.design.widest import NoDesign

    found = _laws()[law](path.problem)
    if isinstance(found, NoDesign):
        raise InputError(
            "no controller meets the stability margins",
            found=found.reason,
            remedy="reduce the required margins, or use fewer operating points",
        )
    return found


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
