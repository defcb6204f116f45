"""The bench's sub-commands: trial, vehicle, replay."""

import threading
from itertools import count
from pathlib import Path
from time import monotonic
from typing import Annotated

import typer
from rich.console import Console
from rich.progress import Progress

import dbc
from protocol.trial_file import TrialFile

TRIPPED = 3  # exit status of a trial that ended early; 2 is a user's mistake, 1 a fault of ours

TrialPath = Annotated[Path, typer.Argument(help="Trial file (TOML).")]
Interface = Annotated[
    str | None, typer.Option(help="python-can interface: socketcan, pcan, kvaser, virtual, ...")
]
Channel = Annotated[str, typer.Option(help="Its channel: can0, PCAN_USBBUS1, 0, ...")]
Bitrate = Annotated[int, typer.Option(help="Bit rate in bit/s, where the interface sets it.")]
FlexibleDataRate = Annotated[bool, typer.Option("--fd", help="Open the bus for CAN FD.")]
DatabasePath = Annotated[Path, typer.Option("--dbc", help="CAN database of the motorcycle.")]


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
    with --real-time alone it rides in this process, on python-can's virtual bus. With --interface
    the gateway speaks to whatever is on that bus, always in real time. Ctrl-C hands back.

    Exit status: 0 done, 2 something given must be mended, 3 the trial tripped.

    Examples:

      slipbench trial trials/throttle_sweep.toml

      slipbench trial trials/spark_sweep.toml --interface socketcan --channel can0
    """
    from bench.buses import BusAddress
    from bench.outcome import invalid
    from bench.preparation import prepare
    from bench.run import run_trial

    prepared = prepare(file, database)
    address = None
    if interface is not None or real_time:
        address = BusAddress(interface or "virtual", channel, bitrate, fd)
    folder = out or _next_folder(Path("runs"), prepared.trial.name)
    console = Console(stderr=True)
    with Progress(console=console, disable=not console.is_terminal, transient=True) as bar:
        task = bar.add_task(prepared.trial.name, total=_expected_duration(prepared.trial))
        outcome = run_trial(
            prepared,
            folder,
            address,
            progress=lambda seconds: bar.update(task, completed=seconds),
            phases=lambda phase: console.print(f"{prepared.trial.name}: {_words(phase.name)}"),
        )
    for note in outcome.notes[:5]:
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
    interface: Annotated[str, typer.Option(help="python-can interface: socketcan, ...")],
    channel: Channel = "can0",
    bitrate: Bitrate = 1_000_000,
    fd: FlexibleDataRate = False,
    database: DatabasePath = dbc.MOTORBIKE,
    duration: Annotated[
        float | None, typer.Option(help="End after so many seconds.  [default: until Ctrl-C]")
    ] = None,
) -> None:
    """Ride the virtual motorcycle of a trial file on a bus, in real time.

    ECU, throttle, encoders, optical sensor and a rider who follows the trial's script. When the
    bench falls silent for 20 ms the devices take authority back, as real ones must.

    Example:

      slipbench vehicle trials/throttle_sweep.toml --interface socketcan --channel vcan0
    """
    from bench.buses import BusAddress
    from bench.live_vehicle import ride_until
    from bench.loop_process import interrupts
    from bench.preparation import prepare

    prepared = prepare(file, database)
    address = BusAddress(interface, channel, bitrate, fd)
    stop = threading.Event()
    ends = None if duration is None else monotonic() + duration
    with interrupts(stop):
        motorcycle = ride_until(
            lambda: stop.is_set() or (ends is not None and monotonic() >= ends),
            prepared.ride,
            prepared.database,
            address,
        )
    for when in motorcycle.taken_back:
        typer.echo(f"authority taken back {when:.3f} s into the ride: the bench was silent")


def replay(
    log: Annotated[Path, typer.Argument(help="Log of frames: candump, ASC, BLF, TRC, MF4, ...")],
    interface: Annotated[str, typer.Option(help="python-can interface: socketcan, virtual, ...")],
    channel: Channel = "can0",
    bitrate: Bitrate = 1_000_000,
    fd: FlexibleDataRate = False,
    speed: Annotated[float, typer.Option(help="Times as fast as recorded.", min=0.001)] = 1.0,
    bus: Annotated[
        str | None, typer.Option(help="Only the frames that the log has from this bus.")
    ] = None,
) -> None:
    """Put the frames of a log onto a bus, at their recorded times or faster.

    Example:

      slipbench replay drive.log --interface socketcan --channel vcan0 --speed 4
    """
    from bench.buses import BusAddress, open_bus
    from bench.clock import MonotonicClock
    from bench.replay import replay as put
    from bench.replay import select_bus, told
    from protocol.logs import read_log

    frames = select_bus(read_log(log).frames, bus, str(log))
    console = Console(stderr=True)
    with (
        open_bus(BusAddress(interface, channel, bitrate, fd), hears_itself=False) as opened,
        Progress(console=console, disable=not console.is_terminal, transient=True) as bar,
    ):
        task = bar.add_task(log.name, total=len(frames))
        done = put(
            frames, opened, MonotonicClock(), speed, lambda count: bar.update(task, completed=count)
        )
    typer.echo(told(done))


def _next_folder(parent: Path, name: str) -> Path:
    """Find the first of runs/<name>-001, -002, ... that is free."""
    taken = {path.name for path in parent.glob(f"{name}-*")}
    number = next(n for n in count(1) if f"{name}-{n:03d}" not in taken)
    return parent / f"{name}-{number:03d}"


def _expected_duration(trial: TrialFile) -> float:
    waiting = trial.operating_point.steady_for + trial.rider.presses_button_after
    return waiting + trial.excitation.duration + trial.settling + trial.hand_back + 1.0


def _words(phase: str) -> str:
    return phase.lower().replace("_", " ")
