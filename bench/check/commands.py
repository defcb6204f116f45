"""The command `slipbench check`."""

import threading
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Console
from rich.live import Live
from rich.text import Text

from slipbench.protocol.errors import InputError
from slipbench.protocol.shipped_files import completion_of, file_of

if TYPE_CHECKING:
    from slipbench.bench.bus.opening import BusAddress
    from slipbench.bench.check.listen import Listener
    from slipbench.bench.check.traffic import BusTraffic
    from slipbench.protocol.binding.binding import Binding

REFRESH = 0.5  # s, between two looks at the last frames
WARNING = """The throttle is requested for 0.5 s{beside}, then the bench falls silent.
Engine off, ignition on, motorcycle on its stand, nobody's fingers at the throttle body."""


def check(
    binding: Annotated[
        Path,
        typer.Argument(
            help="Binding file (TOML).",
            metavar="BINDING",
            parser=file_of("binding"),
            autocompletion=completion_of("binding"),
        ),
    ],
    interface: Annotated[
        str | None,
        typer.Option(help="python-can interface: socketcan, pcan, kvaser, slipbench, ..."),
    ] = None,
    channel: Annotated[
        list[str] | None,
        typer.Option(
            help="Channel of the interface, or BUS=CHANNEL for each bus of the binding; with --log"
            " BUS=BUS_OF_LOG.  [default: can0]"
        ),
    ] = None,
    bitrate: Annotated[int, typer.Option(help="Bit rate in bit/s.", min=1)] = 1_000_000,
    fd: Annotated[bool, typer.Option("--fd", help="Open the bus for CAN FD.")] = False,
    duration: Annotated[float, typer.Option(help="Listen for this time, in s.", min=0.1)] = 10.0,
    log: Annotated[
        Path | None, typer.Option(help="Capture, in place of a bus.", metavar="CAPTURE")
    ] = None,
    database: Annotated[
        Path | None,
        typer.Option(
            "--dbc",
            help="Database in place of the one that the binding names.",
            metavar="FILE",
            parser=file_of("database"),
            autocompletion=completion_of("database"),
        ),
    ] = None,
    silence: Annotated[
        bool,
        typer.Option("--silence", help="Prove that silence gives the throttle back (engine off)."),
    ] = False,
) -> None:
    """Show each role of a binding as it is on the bus, without sending a frame.

    Each role is listed with its last value, age, rate and faults (CRC, counter, range, silence).
    Contradictions between binding and bus follow, each with its remedy: a protection that the frames
    do not have, a request that another node sends, values that no motorcycle has. At the end: what is
    missing for a trial. Ctrl-C ends listening early.

    With --silence it sends, after you have confirmed it: it requests the throttle at its present
    opening (3 % more where no signal states the authority), falls silent, and measures when the ECU
    no longer follows.

    Exit status: 0 all roles are live (with --silence: given back in time), 2 nothing received or
    invalid input (see message), 3 a role is silent or faulty, or the bus contradicts the binding.

    Examples:

      slipbench check my_motorcycle.toml --interface socketcan --channel can0

      slipbench check my_motorcycle.toml --log session.log

      slipbench check my.toml --interface socketcan --channel powertrain=can0 --channel chassis=can1

      slipbench check my_motorcycle.toml --interface socketcan --silence
    """
    from slipbench.bench.bus.channels import addresses_of
    from slipbench.protocol.binding.binding import read_binding

    known = read_binding(binding, database)
    if (interface is None) == (log is None) or (silence and log is not None):
        raise InputError(
            "give one source of frames",
            expected="--interface for a bus, or --log for a capture; --silence needs a bus",
            remedy="as in slipbench check my.toml --interface socketcan --channel can0",
        )
    if log is not None:
        _report(known, _captured(known, log, channel or []))
        return
    addresses = addresses_of(channel or [], known, interface or "", bitrate, fd)
    if silence:
        _silence(known, addresses)
    else:
        _report(known, _heard(known, addresses, duration))


def _captured(binding: "Binding", log: Path, channels: Sequence[str]) -> "BusTraffic":
    """Traffic of a capture. channels: buses of the capture for those of the binding."""
    from slipbench.bench.bus.channels import channels_of
    from slipbench.bench.check.observed_roles import roles_of
    from slipbench.bench.check.traffic import capture_traffic

    if any(binding.buses):
        of_log = channels_of(channels, binding) if channels else binding.buses
        names = dict(zip(of_log, binding.buses, strict=True))
        return capture_traffic(log, binding.database, names=names)
    buses = {source.bus for source in roles_of(binding).roles.values() if source.bus}
    return capture_traffic(log, binding.database, next(iter(sorted(buses)), ""))


def _heard(binding: "Binding", addresses: "Sequence[BusAddress]", duration: float) -> "BusTraffic":
    from slipbench.bench.bus.opening import bus_failure_as_input_error, open_buses
    from slipbench.bench.check.listen import Listener
    from slipbench.bench.loop.clock import MonotonicClock
    from slipbench.bench.loop.interrupts import interrupts

    stop, console = threading.Event(), Console()
    with (
        bus_failure_as_input_error(addresses),
        open_buses(addresses, False) as buses,
        interrupts(stop),
    ):
        named = dict(zip([address.name for address in addresses], buses, strict=True))
        listener = Listener(named, MonotonicClock(), binding.database)
        if not console.is_terminal:
            return listener.listen(duration, stop.is_set)
        return _shown(binding, listener, duration, stop, console)


def _shown(
    binding: "Binding",
    listener: "Listener",
    duration: float,
    stop: threading.Event,
    console: Console,
) -> "BusTraffic":
    """What a thread receives, while the terminal shows the last of it."""
    from slipbench.bench.check.observed_roles import observed_roles
    from slipbench.bench.check.report import table

    with ThreadPoolExecutor(1) as pool, Live(console=console, transient=True) as live:
        hearing = pool.submit(listener.listen, duration, stop.is_set)
        while not wait([hearing], REFRESH).done:
            text = Text(table(observed_roles(binding, listener.recent())), no_wrap=True)
            live.update(text)
        return hearing.result()


def _report(binding: "Binding", traffic: "BusTraffic") -> None:
    from slipbench.bench.check.report import check_report, summary

    report = check_report(binding, traffic)
    typer.echo(summary(report))
    if report.status:
        raise typer.Exit(report.status)


def _silence(binding: "Binding", addresses: "Sequence[BusAddress]") -> None:
    from slipbench.bench.bus.opening import bus_failure_as_input_error, open_buses
    from slipbench.bench.check.silence import SilenceProof
    from slipbench.bench.loop.clock import MonotonicClock

    with bus_failure_as_input_error(addresses), open_buses(addresses, True) as buses:
        proof = SilenceProof(binding, buses, MonotonicClock())
        beside = f", {proof.offset:.0%} from its present opening" if proof.offset else ""
        typer.echo(WARNING.format(beside=beside))
        typer.confirm("Request the throttle now?", abort=True)
        result = proof.run()
    typer.echo(str(result))
    if not result.is_proven:
        raise typer.Exit(3)
