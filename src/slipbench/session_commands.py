"""The commands of a day at the track: session and plan. They join the bench and the identification."""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from slipbench.bench.commands import (
    BindingPath,
    Bitrate,
    Channel,
    DatabasePath,
    FlexibleDataRate,
    Interface,
)
from slipbench.bench.view.commands import (
    Foxglove,
    FoxglovePort,
    View,
    ViewAddress,
    foxglove_address,
    view_address,
)
from slipbench.protocol.errors import InputError
from slipbench.protocol.shipped_files import completion_of, file_of
from slipbench.session_experiment import MOST, run_experiment
from slipbench.session_report import write_report

if TYPE_CHECKING:
    from slipbench.session_experiment import Experiment

NOT_ALL_USABLE = 3  # exit status, as of a trial that tripped


def register(app: typer.Typer) -> None:
    """Add `session`, `plan` and `look` to the one command."""
    app.command()(session)
    app.command()(plan)
    app.command("look")(look_at)


def session(
    plan: Annotated[Path, typer.Argument(help="Session plan (TOML).", metavar="PLAN")],
    out: Annotated[Path, typer.Option(help="Folder of the session; the same one goes on.")],
    simulate: Annotated[
        bool, typer.Option("--simulate", help="Simulate the motorcycle, on a simulated clock.")
    ] = False,
    interface: Interface = None,
    channel: Channel = None,
    bitrate: Bitrate = 1_000_000,
    fd: FlexibleDataRate = False,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="Simulate the motorcycle in real time.")
    ] = False,
    database: DatabasePath = None,
    binding: BindingPath = None,
    explain: Annotated[
        Path | None,
        typer.Option(
            help="Explain the mismatch of the usable runs to the simulation of this vehicle file.",
            metavar="FILE",
            parser=file_of("vehicle"),
            autocompletion=completion_of("vehicle"),
        ),
    ] = None,
    straight: Annotated[
        str | None,
        typer.Option(
            help="After the planned runs, offer a designed trial for what the analysis of --explain"
            " left open, on a straight of this length, as in 900m."
        ),
    ] = None,
    accept: Annotated[
        bool,
        typer.Option("--accept", help="Accept each offer; the rider still arms it by the button."),
    ] = False,
    offers: Annotated[
        int, typer.Option(min=1, max=20, help="Designed trials that are offered at most.")
    ] = MOST,
    view: View = False,
    view_at: ViewAddress = None,
    foxglove: Foxglove = False,
    foxglove_at: FoxglovePort = None,
) -> None:
    """Run the trials of a plan one after another, with a quick look after each and one report.

    One line says what the rider has to do next, and why the bench is not armed yet. The quick look
    gives a verdict: good, repeat (another attempt follows), other amplitude (the trial is not run
    again as it is), or go on. Interrupted at any time,
    the same command goes on where it was; an interrupted recording is kept as
    NAME-incomplete-NUMBER. At the end report.html and session.json have the pooled responses with
    intervals, throttle against spark, and what to do next. With --view a page in the browser shows
    each run and the list of runs, and can abort a trial as Ctrl-C does. With --foxglove every signal is
    streamed to Foxglove, Lichtblick or PlotJuggler.

    With --explain and --straight, a trial is designed for what the analysis left open and offered. An
    accepted one is ridden like the others and explained, until e-values settle each question.

    Exit status: 0 each run is usable, 2 invalid input or a run without an end (see message), 3 not
    each run is usable, 130 stopped.

    Examples:

      slipbench session monday.toml --out monday --simulate

      slipbench session monday.toml --out monday --interface socketcan --channel can0

      slipbench session monday.toml --out monday --simulate --explain vehicle.toml --straight 900m
    """
    from slipbench.bench.descriptors import require_descriptors
    from slipbench.bench.foxglove.stream_process import live_stream
    from slipbench.bench.loop.interrupts import keyboard_interrupt_on_signals
    from slipbench.bench.session.session import Session, open_session, run_session
    from slipbench.bench.session.session_folder import locked
    from slipbench.bench.trials.connection import Connection
    from slipbench.bench.view.view_process import live_view

    _choose_one(simulate, interface, real_time)
    experiment = _experiment(straight, explain, accept, offers)
    require_descriptors()
    connection = Connection(interface, channel or [], bitrate, fd, real_time)
    address, stream = view_address(view, view_at), foxglove_address(foxglove, foxglove_at)
    with (
        keyboard_interrupt_on_signals(),
        locked(out),
        live_view(out, address, _say, take_look=False),
        live_stream(out, stream, _say),
    ):

        def ride() -> Session:
            opened = open_session(plan, out, database, binding)
            usable.append(run_session(opened, connection, look, _say))
            return opened

        usable = list[bool]()
        opened = ride()
        if experiment is not None:
            run_experiment(opened, experiment, ride, _say)
            opened = open_session(plan, out, database, binding)
        typer.echo(f"report: {write_report(opened, explain, _say)}")
    if not usable[-1]:
        raise typer.Exit(NOT_ALL_USABLE)


def plan(
    vehicle: Annotated[
        Path,
        typer.Argument(
            help="Vehicle file (TOML), or the name of one that ships with slipbench.",
            metavar="VEHICLE",
            parser=file_of("vehicle"),
            autocompletion=completion_of("vehicle"),
        ),
    ],
    straight: Annotated[str, typer.Option(help="Length of the straight, as in 900m.")],
    out: Annotated[Path, typer.Option(help="New plan file; trial files go into NAME_trials.")],
    questions: Annotated[
        str,
        typer.Option(
            help="What the session has to answer, with commas: throttle_response, spark_response,"
            " distortion, steps."
        ),
    ] = "throttle_response,spark_response",
) -> None:
    """Propose a session plan that fits into a straight, with trials that were simulated.

    Gear, engine speed and duration follow from the vehicle file and the straight. Each amplitude is
    the largest of a falling series with which the simulated motorcycle ends the trial inside limits
    that are narrower by a quarter. The straight begins where the rider has reached the speed.

    Exit status: 0 done, 2 invalid input (see message).

    Example: slipbench plan motorcycle.toml --straight 900m --out monday.toml
    """
    from slipbench.bench.session.plan_text import folder_of, write_plan
    from slipbench.bench.session.proposal import propose
    from slipbench.bench.session.questions import questions_of
    from slipbench.bench.session.straight import length_of
    from slipbench.protocol.new_file import refuse_existing

    asked, length = questions_of(questions), length_of(straight)
    refuse_existing(out)
    proposed = propose(
        vehicle, length, asked, folder_of(out), lambda line: typer.echo(line, err=True)
    )
    write_plan(proposed, out, vehicle, length)
    typer.echo(out)


def look_at(
    run: Annotated[Path, typer.Argument(help="Run folder of a trial.", metavar="RUN")],
) -> None:
    """Take the quick look at a run: band, coherence, margins, verdict, in a few lines.

    It goes into quick_look.json of the run folder, as in a session.

    Exit status: 0 done, 2 invalid input (see message).

    Example: slipbench look runs/throttle_sweep-1
    """
    from slipbench.bench.session.session_folder import write_look

    _require_run(run)
    found = look(run, ())
    write_look(run, found)
    for line in found["lines"]:
        typer.echo(line)
    typer.echo(f"{found['verdict']}: {found['reason']}")


def look(run: Path, earlier: Sequence[Path]) -> dict[str, Any]:
    """Quick look at a run folder for quick_look.json. earlier: run folders of the same trial."""
    from slipbench.bench.session.session_folder import read_look
    from slipbench.identification.session.quick_look import (
        earlier_responses,
        look_tree,
        quick_look_of,
    )

    known = earlier_responses([read_look(each) for each in earlier])
    return look_tree(quick_look_of(run, known))


def _require_run(run: Path) -> None:
    """Check that a folder is a run folder. Raises InputError."""
    from slipbench.protocol.recording.run_folder import DESCRIPTION

    if not (run / DESCRIPTION).exists():
        raise InputError(
            "this is no run folder",
            where=str(run),
            expected=f"a folder with {DESCRIPTION}",
            remedy="give the folder that `slipbench trial` printed",
        )


def _say(line: str) -> None:
    """Print a line. A lost terminal is ignored, so that it does not end a trial."""
    with suppress(OSError):
        typer.echo(line)


def _experiment(
    straight: str | None, vehicle: Path | None, accept: bool, offers: int
) -> "Experiment | None":
    """What is allowed of designed trials; None: none is offered. Raises InputError."""
    from slipbench.bench.session.straight import length_of
    from slipbench.session_experiment import Experiment

    if straight is None and not accept:
        return None
    if straight is None or vehicle is None:
        raise InputError(
            "a trial cannot be designed",
            expected="--explain FILE and --straight LENGTH",
            found=f"no {'--straight' if straight is None else '--explain'}",
            remedy="name the nominal vehicle file and the length of the straight",
        )
    return Experiment(length_of(straight), vehicle, accept, offers)


def _choose_one(simulate: bool, interface: str | None, real_time: bool) -> None:
    """Check that exactly one place is named. Raises InputError."""
    if simulate + real_time + (interface is not None) == 1:
        return
    raise InputError(
        "a session needs one place to run",
        expected="one of --interface, --simulate, --real-time",
        remedy="--interface for a motorcycle, --simulate to rehearse the plan",
    )
