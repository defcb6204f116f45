"""Print what was read, bound, missing or wrong."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from slipbench.protocol.codec.faults import Fault
from slipbench.protocol.logs.decode_file import Tally
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.recording import Recording

SHOWN = 12  # identifiers


def decoded(form: str, warnings: list[str], tally: Tally, samples: int, out: Path) -> None:
    """Print what `slipbench decode` did with a log of the format `form`."""
    console = _console()
    span = (tally.last - tally.first) * 1e-9
    console.print(f"{tally.frames} frames of {form} in {span:.3f} s on {', '.join(tally.buses)}")
    for name, count in tally.short.items():
        console.print(f"{name}: {count} frames are too short and were not decoded")
    _unknown(console, tally.unknown)
    for kind, count in tally.skipped.items():
        console.print(f"{count} {kind} beside the data frames")
    _warnings(console, warnings)
    console.print(f"{samples} samples in {out}")


def imported(recording: Recording) -> None:
    """Print what `slipbench import` wrote."""
    console = _console()
    for source in recording.description.get("sources", []):
        if "layout" in source:
            console.print(f"{source['file']}: {source['layout']}")
    table = Table("role", "samples", "rate / Hz", "from / s", "to / s", "range", "origin", box=None)
    for channel in recording.channels.values():
        table.add_row(*_row(channel))
    console.print(table)
    for role, reason in recording.missing.items():
        console.print(f"missing: {role}: {reason}")
    _unknown(
        console,
        {
            int(fault.message, 16): fault.count
            for fault in recording.faults
            if fault.fault == Fault.UNKNOWN
        },
    )
    for fault in recording.faults:
        if fault.fault != Fault.UNKNOWN:
            first = f"first at {fault.first_time:.3f} s"
            console.print(f"{fault.message}: {fault.fault}: {fault.count}, {first}")
    _warnings(console, recording.description["warnings"])
    console.print(
        f"{recording.frame_count} frames, {recording.duration:.3f} s in {recording.folder}"
    )


def _row(channel: Channel) -> tuple[str, ...]:
    span = channel.time[-1] - channel.time[0]
    rate = f"{(channel.time.size - 1) / span:.1f}" if span > 0 else "-"
    unit = "" if channel.unit == "1" else f" {channel.unit}"
    values = f"{np.min(channel.value):.4g} .. {np.max(channel.value):.4g}{unit}"
    return (
        channel.role,
        str(channel.time.size),
        rate,
        f"{channel.time[0]:.3f}",
        f"{channel.time[-1]:.3f}",
        values,
        channel.origin,
    )


def _unknown(console: Console, counts: Mapping[int, int]) -> None:
    if not counts:
        return
    most = sorted(counts.items(), key=lambda one: -one[1])
    listed = ", ".join(f"{identifier:#05x} {count}" for identifier, count in most[:SHOWN])
    more = f" and {len(most) - SHOWN} more" if len(most) > SHOWN else ""
    console.print(
        f"{sum(counts.values())} frames of {len(counts)} identifiers that the database does not"
        f" know (kept): {listed}{more}"
    )


def _warnings(console: Console, warnings: tuple[str, ...] | list[str]) -> None:
    for warning in warnings:
        console.print(f"warning: {warning}", style="yellow")


def _console() -> Console:
    console = Console(highlight=False, markup=False, emoji=False)
    if not console.is_terminal:
        console = Console(highlight=False, markup=False, emoji=False, width=200)
    return console
