"""Clocks, faults, channels, bus and bench of a recording, as rows of words."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.clocks import BUS, ClockFit
from slipbench.protocol.codec.faults import Fault
from slipbench.protocol.recording.recording import Recording

Rows = list[tuple[str, str]]


def clocks(found: Identification) -> list[tuple[str, ...]]:
    """Say how each device's clock runs."""
    rows: list[tuple[str, ...]] = []
    for name, fit in found.data.clocks.items():
        if isinstance(fit, ClockFit):
            p50, p99 = (f"{x * 1e6:.0f} µs" for x in (fit.latency_p50, fit.latency_p99))
            rows.append(
                (name, f"{round(fit.drift * 1e6, 2) + 0.0:+.2f} ppm", p50, p99, str(fit.samples))
            )
        else:
            rows.append((name, "not aligned", fit.reason, "", ""))
    return rows


def faults(recording: Recording) -> list[tuple[str, str, int, str]]:
    """List faulty frames by message."""
    return [
        (f.message, f.fault, f.count, f"{f.first_time:.3f} s")
        for f in recording.faults
        if f.fault != Fault.UNKNOWN
    ]


def unknown_identifiers(recording: Recording) -> list[tuple[str, int, str]]:
    """List identifiers that no database knows."""
    return [
        (f.message, f.count, f"{f.first_time:.3f} s")
        for f in recording.faults
        if f.fault == Fault.UNKNOWN
    ]


def roles(found: Identification) -> list[tuple[str, str, str, str, str]]:
    """List every channel with where it comes from."""
    rows = []
    for role, channel in sorted(found.recording.channels.items()):
        step = np.median(np.diff(channel.time)) if channel.time.size > 1 else np.nan
        rate = f"{1 / step:.4g} Hz" if step > 0 else "–"
        clock = "bus" if channel.clock == BUS else channel.clock
        rows.append((role, str(channel.time.size), rate, clock, channel.origin))
    for role, reason in sorted(found.data.absent.items()):
        rows.append((role, "–", "–", "–", reason))
    return rows


def bus_load(recording: Recording) -> Rows:
    """Say how loaded each bus was."""
    return [
        (bus, f"{of['mean'] * 100:.1f} % on average, {of['peak'] * 100:.1f} % at most in 0.1 s")
        for bus, of in recording.bus_load.items()
    ]


def lateness(recording: Recording) -> Rows:
    """Say how late the bench's ticks were."""
    told = recording.description.get("lateness")
    if not isinstance(told, Mapping):
        return []
    return [
        (label, _duration(value) if isinstance(value, float) else str(value))
        for key, label in _LATENESS.items()
        if (value := told.get(key)) is not None
    ]


_LATENESS = {
    "period": "period of the ticks",
    "due": "ticks due",
    "ran": "ticks that ran",
    "skipped": "ticks skipped",
    "p50": "lateness, median",
    "p99": "99 % are earlier than",
    "p99_9": "99.9 % are earlier than",
    "max": "latest tick",
}


def provenance(recording: Recording) -> Rows:
    """Say which versions, database and vehicle made the recording."""
    kept = {k: v for k, v in recording.description.items() if k not in ("lateness", "trial")}
    return [
        ("Folder", recording.folder.name),
        ("Role map", recording.roles.title),
        *_flat(kept, str),
    ]


def _flat(tree: Mapping[str, Any], say: Callable[[float], str], path: str = "") -> Rows:
    rows: Rows = []
    for key, value in tree.items():
        label = f"{path} {key}".strip().replace("_", " ")
        if isinstance(value, Mapping):
            rows += _flat(value, say, label)
        elif isinstance(value, float):
            rows.append((label, say(value)))
        elif isinstance(value, str | int):
            rows.append((label, str(value)))
    return rows


def _duration(value: float) -> str:
    return f"{value * 1e6:.1f} µs" if abs(value) < 1e-3 else f"{value * 1e3:.2f} ms"
