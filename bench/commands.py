"""The bench's sub-commands: trial, vehicle, replay."""

import math
import os
import threading
from contextlib import AbstractContextManager, nullcontext, suppress
from itertools import count
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress

from slipbench import dbc
from slipbench.bench.descriptors import require_descriptors
from slipbench.bench.replay.replay_controls import FASTEST
from slipbench.protocol.errors import InputError
from slipbench.protocol.shipped_files import completion_of, file_of

if TYPE_CHECKING:
    from slipbench.bench.replay.replay_process import Report, RunningReplay

A_LIFETIME = 1_000_000_000  # s, or passes: all that the controls of a replay can hold
TRIPPED = 3  # exit status of a trial that ended early; 2 is a user's mistake, 1 a fault of ours

TrialPath = Annotated[
    Path,
    typer.Argument(
        help="Trial file (TOML), or the name of one that ships with slipbench.",
        metavar="FILE",
        parser=file_of("trial"),
        autocompletion=completion_of("trial"),
    ),
]
INTERFACES = (
    "python-can interface: socketcan, pcan, kvaser, ..., or slipbench (this project's own bus)."
)
Interface = Annotated[str | None, typer.Option(help=INTERFACES)]
Channel = Annotated[str, typer.Option(help="Its channel: can0, PCAN_USBBUS1, 0, ...")]
Bitrate = Annotated[
    int, typer.Option(help="Bit rate in bit/s, where the interface sets it.", min=1)
]
FlexibleDataRate = Annotated[bool, typer.Option("--fd", help="Open the bus for CAN FD.")]
DatabasePath = Annotated[
    Path,
    typer.Option(
        "--dbc",
        help="CAN database of the motorcycle.",
        metavar="FILE",
        parser=file_of("database"),
        autocompletion=completion_of("database"),
    ),
]


def register(app: typer.Typer) -> None:
    """Add the bench's commands to the one command."""
    app.command()(trial)
    app.command()(vehicle)
    app.command()(replay)


def trial(
    file: TrialPath,
    out: Annotated[
        Path | None, typer.Option(help="Run folder to make.  [default: runs/NAME-NUMBER]")
    ] = None,
    interface: Interface = None,
    channel: Channel = "can0",
    bitrate: Bitrate = 1_000_000,
    fd: FlexibleDataRate = False,
    real_time: Annotated[
        bool, typer.Option("--real-time", help="Run on the machine's clock.")
    ] = False,
    database: DatabasePath = dbc.MOTORBIKE,
) -> None:
    """Run a trial and record it; prints the run folder.

    Without --interface the virtual motorcycle rides on the simulated clock, faster than real time;
    with --real-time alone it rides in a process of its own, on a virtual bus. With --interface
    the gateway speaks to whatever is on that bus, always in real time. Ctrl-C aborts the trial and
    returns control to the rider.

    Exit status: 0 done, 2 invalid input (see message), 3 the trial tripped.

    Examples:

      slipbench trial examples/trials/throttle_sweep.toml

      slipbench trial examples/trials/spark_sweep.toml --interface socketcan --channel can0
    """
    from slipbench.bench.bus.opening import BusAddress
    from slipbench.bench.loop.interrupts import keyboard_interrupt_on_signals
    from slipbench.bench.trials.outcome import in_short, invalid
    from slipbench.bench.trials.preparation import prepare
    from slipbench.bench.trials.progress import script_duration
    from slipbench.bench.trials.run import run_trial
    from slipbench.bench.vehicle.live_vehicle import VehicleProcess, vehicle_process

    require_descriptors()
    prepared = prepare(file, database)
    address: BusAddress | None = None
    beside: AbstractContextManager[VehicleProcess | None] = nullcontext()
    if interface is not None:
        address = BusAddress(interface, channel, bitrate, fd)
    elif real_time:
        address = BusAddress("slipbench", f"trial-{os.getpid()}", bitrate, fd)
        beside = vehicle_process(prepared.scenario, prepared.database, address)
    folder = out or _next_folder(Path("runs"), prepared.trial.name)
    console = Console(stderr=True)
    bar = Progress(console=console, disable=not console.is_terminal, transient=True)
    with keyboard_interrupt_on_signals(), beside as process, bar:
        task = bar.add_task(prepared.trial.name, total=script_duration(prepared.trial))
        outcome = run_trial(
            prepared,
            folder,
            address,
            progress=lambda seconds: bar.update(task, completed=seconds),
            phases=lambda phase: _tell(console, f"{prepared.trial.name}: {_words(phase.name)}"),
            vehicle=process,
        )
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
    channel: Channel = "can0",
    bitrate: Bitrate = 1_000_000,
    fd: FlexibleDataRate = False,
    database: DatabasePath = dbc.MOTORBIKE,
    duration: Annotated[
        float | None,
        typer.Option(help="End after so many seconds.  [default: until Ctrl-C]", min=0),
    ] = None,
) -> None:
    """Ride the virtual motorcycle of a trial file on a bus, in real time.

    ECU, throttle, encoders, optical sensor and a rider who follows the trial's script. When the
    bench falls silent for 20 ms the devices take authority back, as real ones must.

    Example:

      slipbench vehicle examples/trials/throttle_sweep.toml --interface socketcan --channel vcan0
    """
    from slipbench.bench.bus.opening import BusAddress
    from slipbench.bench.loop.interrupts import interrupts
    from slipbench.bench.trials.preparation import prepare
    from slipbench.bench.vehicle.live_vehicle import simulate_until

    require_descriptors()
    prepared = prepare(file, database)
    address = BusAddress(interface, channel, bitrate, fd)
    stop = threading.Event()
    ends = None if duration is None else monotonic() + duration
    with interrupts(stop):
        motorcycle = simulate_until(
            lambda: stop.is_set() or (ends is not None and monotonic() >= ends),
            prepared.scenario,
            prepared.database,
            address,
            ready=lambda: typer.echo(
                f"{prepared.scenario.vehicle.name} rides on {interface}, channel {channel}, "
                f"at {bitrate} bit/s; Ctrl-C ends the ride"
            ),
        )
    for when in motorcycle.watchdog_timeouts:
        typer.echo(f"authority taken back {when:.3f} s into the ride: the bench was silent")


def replay(
    log: Annotated[Path, typer.Argument(help="Log of frames: candump, ASC, BLF, TRC, MF4, ...")],
    interface: Annotated[str, typer.Option(help=INTERFACES)],
    channel: Annotated[
        list[str] | None,
        typer.Option(help="Its channel, or LOGBUS=CHANNEL; may be repeated.  [default: can0]"),
    ] = None,
    bitrate: Bitrate = 1_000_000,
    fd: FlexibleDataRate = False,
    speed: Annotated[
        float, typer.Option(help="Times as fast as recorded.", min=0.001, max=FASTEST)
    ] = 1.0,
    bus: Annotated[
        list[str] | None, typer.Option(help="Only this bus of the log; may be repeated.")
    ] = None,
    only: Annotated[str, typer.Option(help="Only these identifiers: 0x10,0x200-0x2FF.")] = "",
    without: Annotated[str, typer.Option(help="All but these identifiers.")] = "",
    start: Annotated[
        float, typer.Option(help="Begin so many seconds into the log.", min=0, max=A_LIFETIME)
    ] = 0.0,
    passes: Annotated[
        int, typer.Option(help="How often; 0: until stopped.", min=0, max=A_LIFETIME)
    ] = 1,
    report: Annotated[
        Path | None, typer.Option(help="New file for the timing report (TOML).")
    ] = None,
) -> None:
    """Put the frames of a log onto one bus or several, never before their recorded times.

    On a terminal: space pauses, left and right go 10 s back and on, - and + halve and double the
    speed, q and Ctrl-C stop. Order is kept, each frame has a deadline of its own from the recorded
    times, and how late each was is told at the end.

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
        if start * 1e9 > running.ready.span:
            raise InputError(
                "--start is beyond the last frame",
                where=str(log),
                expected=f"at most {running.ready.span * 1e-9:g} s",
                found=f"{start:g} s",
            )
        if start:
            running.controls.seek(round(start * 1e9))
        done = _watch(running, log.name)
        table = timing(running.ready, done)
    typer.echo(summary(table))
    if report is not None:
        write(table, report)


def _tell(console: Console, text: str) -> None:
    """Print a line; a terminal that is gone keeps no trial from being described."""
    with suppress(OSError):
        console.print(text)


def _watch(running: "RunningReplay", name: str) -> "Report":
    """Show where the replay is and pass keys on, until it ends."""
    from slipbench.bench.loop.interrupts import interrupts
    from slipbench.bench.replay.replay_keys import HELP, keys, pressed, steer
    from slipbench.bench.replay.replay_process import ENDING
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
                deadline = min(deadline, monotonic() + ENDING)
            if monotonic() > deadline:
                raise InputError(
                    "the replay's process did not end when asked to, and was killed",
                    found=f"no answer within {ENDING:g} s",
                    remedy="was it stopped (SIGSTOP), or does the bus hang? see to the interface",
                )
    return done


def _next_folder(parent: Path, name: str) -> Path:
    """Find the first of runs/<name>-001, -002, ... that is free."""
    taken = {path.name for path in parent.glob(f"{name}-*")}
    number = next(n for n in count(1) if f"{name}-{n:03d}" not in taken)
    return parent / f"{name}-{number:03d}"


def _words(phase: str) -> str:
    return phase.lower().replace("_", " ")
