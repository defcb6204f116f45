"""The commands of the bench: trial, vehicle, replay."""

import math
import threading
from contextlib import suppress
from dataclasses import replace
from itertools import count
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress

from slipbench.bench.check.commands import check
from slipbench.bench.descriptors import require_descriptors
from slipbench.bench.replay.replay_controls import FASTEST
from slipbench.bench.view import commands as view_commands
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

if TYPE_CHECKING:
    from slipbench.bench.replay.replay_process import Report, RunningReplay
    from slipbench.bench.trials.outcome import Outcome

LARGEST = 1_000_000_000  # s, or passes: what the shared controls of a replay can hold
TRIPPED = 3  # exit status of a trial that tripped; 2 is invalid input, 1 a fault of the program

TrialPath = Annotated[
    Path,
    typer.Argument(
        help="Trial file (TOML), or the name of one that ships with slipbench.",
        metavar="FILE",
        parser=file_of("trial"),
        autocompletion=completion_of("trial"),
    ),
]
NODES = "ecu, throttle, rear_encoder, front_encoder (both: encoders), optical, rider"
INTERFACES = (
    "python-can interface: socketcan, pcan, kvaser, ..., or slipbench (this project's own bus)."
)
Interface = Annotated[str | None, typer.Option(help=INTERFACES)]
Channel = Annotated[
    list[str] | None,
    typer.Option(
        help="Channel of the interface: can0, PCAN_USBBUS1, 0, ...; BUS=CHANNEL for each bus of the"
        " binding where it has several.  [default: can0]"
    ),
]
Bitrate = Annotated[
    int, typer.Option(help="Bit rate in bit/s. Ignored by socketcan: set it with ip link.", min=1)
]
FlexibleDataRate = Annotated[bool, typer.Option("--fd", help="Open the bus for CAN FD.")]
DatabasePath = Annotated[
    Path | None,
    typer.Option(
        "--dbc",
        help="CAN database of the motorcycle.",
        show_default="that of the binding, else motorbike.dbc, which ships with slipbench",
        metavar="FILE",
        parser=file_of("database"),
        autocompletion=completion_of("database"),
    ),
]

BindingPath = Annotated[
    Path | None,
    typer.Option(
        "--binding",
        help="Binding file: where the roles of the bench lie on your bus.",
        show_default="the bench's own database",
        metavar="FILE",
        parser=file_of("binding"),
        autocompletion=completion_of("binding"),
    ),
]


def register(app: typer.Typer) -> None:
    """Add the commands of the bench to the application."""
    app.command()(trial)
    app.command()(vehicle)
    app.command()(replay)
    app.command()(check)
    view_commands.register(app)


def trial(
    file: TrialPath,
    out: Annotated[
        Path | None, typer.Option(help="New run folder.  [default: runs/NAME-NUMBER]")
    ] = None,
    interface: Interface = None,
    channel: Channel = None,
    bitrate: Bitrate = 1_000_000,
    fd: FlexibleDataRate = False,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="Run in real time instead of simulated time.")
    ] = False,
    database: DatabasePath = None,
    binding: BindingPath = None,
    view: View = False,
    view_at: ViewAddress = None,
    foxglove: Foxglove = False,
    foxglove_at: FoxglovePort = None,
) -> None:
    """Run a trial, record it and print the run folder.

    Without --interface the motorcycle is simulated, on a simulated clock that is faster than real
    time. With --real-time alone the motorcycle is simulated in real time, in a separate process, on
    a virtual CAN bus. With --interface the gateway uses the CAN bus of that interface, always in
    real time. Ctrl-C aborts the trial and returns control to the rider; with --view a page in the
    browser shows the trial and can abort it in the same way. With --foxglove every signal is streamed
    to Foxglove, Lichtblick or PlotJuggler, which cannot abort it.

    Exit status: 0 done, 2 invalid input (see message), 3 the trial tripped.

    Examples:

      slipbench trial examples/trials/throttle_sweep.toml

      slipbench trial examples/trials/spark_sweep.toml --interface socketcan --channel can0

      slipbench trial throttle_sweep --binding my.toml --interface socketcan \\
        --channel powertrain=can0 --channel chassis=can1
    """
    from slipbench.bench.foxglove.stream_process import live_stream
    from slipbench.bench.loop.interrupts import keyboard_interrupt_on_signals
    from slipbench.bench.trials.connection import Connection, connected
    from slipbench.bench.trials.outcome import in_short, invalid
    from slipbench.bench.trials.preparation import prepare
    from slipbench.bench.trials.progress import script_duration
    from slipbench.bench.trials.run import run_trial
    from slipbench.bench.view.view_process import live_view

    require_descriptors()
    address, stream = view_address(view, view_at), foxglove_address(foxglove, foxglove_at)
    prepared = prepare(file, database, binding)
    connection = Connection(interface, channel or [], bitrate, fd, real_time)
    folder = out or _next_folder(Path("runs"), prepared.trial.name)
    console = Console(stderr=True)
    bar = Progress(console=console, disable=not console.is_terminal, transient=True)
    outcome: Outcome | None = None
    try:
        with (
            keyboard_interrupt_on_signals(),
            live_view(folder, address, lambda line: _print(console, line), take_look=True),
            live_stream(folder, stream, lambda line: _print(console, line)),
            connected(prepared, connection) as (addresses, process),
            bar,
        ):
            task = bar.add_task(prepared.trial.name, total=script_duration(prepared.trial))
            outcome = run_trial(
                prepared,
                folder,
                addresses,
                progress=lambda seconds: bar.update(task, completed=seconds),
                phases=lambda phase: _print(
                    console, f"{prepared.trial.name}: {_words(phase.name)}"
                ),
                vehicle=process,
            )
    except KeyboardInterrupt:
        if outcome is None:
            raise  # otherwise the trial was over, and only the view was not
    for note in in_short(outcome.notes):
        console.print(f"note: {note}")
    if why_not := invalid(outcome, prepared.trial.timing):
        console.print(f"{prepared.trial.name} is invalid: {why_not}", style="yellow")
    if outcome.trip:
        console.print(f"{prepared.trial.name} tripped: {outcome.trip}")
    typer.echo(folder)
    if not outcome.done:
        raise typer.Exit(TRIPPED)


def vehicle(
    file: TrialPath,
    interface: Annotated[str, typer.Option(help=INTERFACES)],
    channel: Channel = None,
    bitrate: Bitrate = 1_000_000,
    fd: FlexibleDataRate = False,
    database: DatabasePath = None,
    binding: BindingPath = None,
    duration: Annotated[
        float | None,
        typer.Option(help="End after this time, in s.  [default: until Ctrl-C]", min=0),
    ] = None,
    only: Annotated[str, typer.Option(help=f"Simulate only these nodes, of {NODES}.")] = "",
    without: Annotated[str, typer.Option(help="Leave these nodes to real devices.")] = "",
    faults: Annotated[
        Path | None, typer.Option(help="Fault plan of the simulated nodes (JSON).", metavar="FILE")
    ] = None,
) -> None:
    """Simulate the virtual motorcycle of a trial file on a CAN bus, in real time.

    It simulates the ECU, the throttle body, the wheel encoders, the optical speed sensor and a rider
    who follows the script of the trial file. After 20 ms without a command from the bench (command
    watchdog timeout) the devices return authority to the rider, as the real devices must.

    With --without or --only, real devices take the place of nodes (restbus simulation): the
    motorcycle follows what they send. It ends where one of them is silent or late, or where another
    device sends for a simulated node.

    Examples:

      slipbench vehicle examples/trials/throttle_sweep.toml --interface socketcan --channel vcan0

      slipbench vehicle throttle_sweep --interface socketcan --without throttle
    """
    from slipbench.bench.bus.channels import addresses_of
    from slipbench.bench.bus.faults import NO_FAULTS
    from slipbench.bench.bus.plan_text import load_plan
    from slipbench.bench.loop.interrupts import interrupts
    from slipbench.bench.trials.preparation import prepare
    from slipbench.bench.vehicle.live_vehicle import simulate_until
    from slipbench.bench.vehicle.nodes import simulated_nodes

    require_descriptors()
    nodes = simulated_nodes(only, without)
    plan = load_plan(faults) if faults else NO_FAULTS
    prepared = prepare(file, database, binding)
    scenario = replace(prepared.scenario, nodes=nodes, faults=plan)
    addresses = addresses_of(channel or [], prepared.binding, interface, bitrate, fd)
    stop = threading.Event()
    ends = None if duration is None else monotonic() + duration
    with interrupts(stop):
        motorcycle = simulate_until(
            lambda: stop.is_set() or (ends is not None and monotonic() >= ends),
            scenario,
            prepared.binding,
            addresses,
            ready=lambda: typer.echo(
                f"simulating {scenario.vehicle.name} on {interface}, "
                f"channel {', '.join(address.channel for address in addresses)}, at {bitrate} bit/s; Ctrl-C ends the simulation"
            ),
            waiting=lambda missing: typer.echo(
                f"waiting for the real {', '.join(missing)}" if missing else "all real devices send"
            ),
        )
    for when in motorcycle.watchdog_timeouts:
        typer.echo(
            f"watchdog timeout at {when:.3f} s: no command for "
            f"{prepared.trial.command.silence * 1e3:g} ms, authority returned to the rider"
        )


def replay(
    log: Annotated[
        Path, typer.Argument(help="CAN log: candump, ASC, BLF, TRC, MF4, ...", metavar="LOG")
    ],
    interface: Annotated[str, typer.Option(help=INTERFACES)],
    channel: Annotated[
        list[str] | None,
        typer.Option(
            help="Channel of the interface, or BUS_OF_LOG=CHANNEL; may be repeated."
            "  [default: can0]"
        ),
    ] = None,
    bitrate: Bitrate = 1_000_000,
    fd: FlexibleDataRate = False,
    speed: Annotated[
        float,
        typer.Option(help="Replay speed; 2 is twice as fast as recorded.", min=0.001, max=FASTEST),
    ] = 1.0,
    bus: Annotated[
        list[str] | None, typer.Option(help="Replay only this bus of the log; may be repeated.")
    ] = None,
    only: Annotated[
        str, typer.Option(help="Replay only these identifiers: 0x10,0x200-0x2FF.")
    ] = "",
    without: Annotated[str, typer.Option(help="Leave out these identifiers.")] = "",
    start: Annotated[
        float, typer.Option(help="Start at this time of the log, in s.", min=0, max=LARGEST)
    ] = 0.0,
    passes: Annotated[
        int, typer.Option(help="Number of passes; 0 repeats until stopped.", min=0, max=LARGEST)
    ] = 1,
    report: Annotated[
        Path | None, typer.Option(help="New file for the timing report (TOML).")
    ] = None,
) -> None:
    """Replay the frames of a CAN log on one or more buses, in order and never early.

    Each frame has an absolute deadline, computed from its recorded time. The timing report at the
    end states how late the frames were sent. Keys on a terminal: space pauses, left and right jump
    10 s back and forward, - and + halve and double the speed, q and Ctrl-C stop.

    Exit status: 0 done or stopped, 2 invalid input (see message).

    Examples:

      slipbench replay drive.log --interface socketcan --channel vcan0 --speed 4

      slipbench replay drive.log --interface socketcan --channel can0=vcan0 --channel can1=vcan1

      slipbench replay drive.log --interface socketcan --only 0x10,0x200-0x2FF --passes 0
    """
    from slipbench.bench.replay.replay_process import ReplayOrder, running_replay
    from slipbench.bench.replay.replay_report import summary, timing, write

    require_descriptors()
    order = ReplayOrder(
        log, interface, tuple(channel or ["can0"]), tuple(bus or []), only, without, bitrate, fd
    )
    with running_replay(order, speed, passes) as running:
        _seek(running, start, log)
        done = _watch(running, log.name)
        table = timing(running.ready, done)
    typer.echo(summary(table))
    if report is not None:
        write(table, report)


def _seek(running: "RunningReplay", start: float, log: Path) -> None:
    """Begin at `start` s of the log. Raises InputError where this is after its last frame."""
    if start * 1e9 > running.ready.span:
        raise InputError(
            "--start is after the last frame",
            where=str(log),
            expected=f"at most {running.ready.span * 1e-9:g} s",
            found=f"{start:g} s",
        )
    if start:
        running.controls.seek(round(start * 1e9))


def _print(console: Console, text: str) -> None:
    """Print a line. A lost terminal is ignored, so that the trial still gets its description."""
    with suppress(OSError):
        console.print(text)


def _watch(running: "RunningReplay", name: str) -> "Report":
    """Report of a replay; until it ends, show its progress and apply the keys that are pressed."""
    from slipbench.bench.loop.interrupts import interrupts
    from slipbench.bench.replay.replay_keys import HELP, keys, pressed, steer
    from slipbench.bench.replay.replay_process import END_TIMEOUT
    from slipbench.bench.replay.replay_report import position

    console = Console(stderr=True)
    ready, controls = running.ready, running.controls
    bar = Progress(console=console, disable=not console.is_terminal, transient=True)
    name = escape(name)
    stop, deadline = threading.Event(), math.inf
    with interrupts(stop), keys() as listening, bar:
        if listening:
            console.print(HELP)
        task = bar.add_task(name, total=ready.frames)
        running.begin()
        while (done := running.report(within=0.05)) is None:
            bar.update(
                task,
                completed=controls.following,
                description=f"{name}: {position(controls, ready.span)}",
            )
            for key in pressed() if listening else ():
                steer(controls, key)
            if stop.is_set():
                controls.stop()
                deadline = min(deadline, monotonic() + END_TIMEOUT)
            if monotonic() > deadline:
                raise InputError(
                    "the replay process did not end when asked to, and was killed",
                    found=f"no response within {END_TIMEOUT:g} s",
                    remedy="check the CAN interface, and that the process was not stopped (SIGSTOP)",
                )
    return done


def _next_folder(parent: Path, name: str) -> Path:
    """Path of the first run folder NAME-001, NAME-002, ... that does not exist."""
    taken = {path.name for path in parent.glob(f"{name}-*")}
    number = next(n for n in count(1) if f"{name}-{n:03d}" not in taken)
    return parent / f"{name}-{number:03d}"


def _words(phase: str) -> str:
    """Name of a phase for the terminal."""
    return phase.lower().replace("_", " ")
