"""Table rows for a report: clocks, faults, channels, bus load, lateness, provenance."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from slipbench.identification.report.words import time_unit, unit
from slipbench.identification.response.identify import Identification
from slipbench.identification.signals.clocks import BUS, ClockFit
from slipbench.protocol.codec.faults import Fault
from slipbench.protocol.recording.channel import Channel, FloatArray
from slipbench.protocol.recording.recording import Recording

Rows = list[tuple[str, str]]
UNEVEN = 0.5
"""Range of 90 % of the steps, over their median, from which a channel is sampled unevenly."""


def clocks(found: Identification) -> list[tuple[str, ...]]:
    """Rows of clock name, drift, median and 99 % latency, samples; one per device clock."""
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
    """Rows of message, fault, frames and first occurrence."""
    return [
        (f.message, f.fault, f.count, f"{f.first_time:.3f} s")
        for f in recording.faults
        if f.fault != Fault.UNKNOWN
    ]


def unknown_identifiers(recording: Recording) -> list[tuple[str, int, str]]:
    """Rows of identifier, frames and first occurrence for frames that are in no database."""
    return [
        (f.message, f.count, f"{f.first_time:.3f} s")
        for f in recording.faults
        if f.fault == Fault.UNKNOWN
    ]


def on_bus(recording: Recording) -> bool:
    """Whether the recording has frames of a bus, or statistics of the bench."""
    return bool(recording.frame_count or recording.bus_load or lateness(recording))


def channels(found: Identification) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Head and rows of channel, unit, samples, rate, clock and source; absent ones with the reason.

    Without a bus and without clocks of devices there is no column of clocks.
    """
    clocked = on_bus(found.recording) or bool(found.data.clocks)
    head = ("channel", "unit", "samples", "rate", "clock", "source")
    rows = [_channel(one) for _, one in sorted(found.recording.channels.items())]
    rows += [(role, "–", "–", "–", "–", why) for role, why in sorted(found.data.absent.items())]
    kept = [column for column in head if clocked or column != "clock"]
    return tuple(kept), [tuple(row[head.index(column)] for column in kept) for row in rows]


def _channel(of: Channel) -> tuple[str, ...]:
    clock = "bus" if of.clock == BUS else of.clock
    return of.role, unit(of.unit, of.stated), str(of.time.size), _rate(of.time), clock, of.origin


def _rate(time: FloatArray) -> str:
    """Median rate; where the steps differ, also the range of 90 % of them. time: (n,) s."""
    if time.size < 2:
        return "–"
    low, step, high = np.quantile(np.diff(time), (0.05, 0.5, 0.95))
    if not step > 0:
        return "–"
    rate = f"{1 / step:.4g} Hz"
    if high - low <= UNEVEN * step:
        return rate
    factor, each = time_unit(float(step))
    return f"{rate}, uneven: steps of {factor * low:.3g} to {factor * high:.3g} {each}"


def bus_load(recording: Recording) -> Rows:
    """Rows of bus and its mean and peak load."""
    return [
        (bus, f"mean {of['mean'] * 100:.1f} %, peak {of['peak'] * 100:.1f} % in 0.1 s")
        for bus, of in recording.bus_load.items()
    ]


def lateness(recording: Recording) -> Rows:
    """Rows of the tick statistics; none where the bench recorded none."""
    recorded = recording.description.get("lateness")
    if not isinstance(recorded, Mapping):
        return []
    return [
        (label, _duration(value) if isinstance(value, float) else str(value))
        for key, label in _LATENESS.items()
        if (value := recorded.get(key)) is not None
    ]


_LATENESS = {
    "period": "tick period",
    "due": "scheduled ticks",
    "ran": "executed ticks",
    "skipped": "skipped ticks",
    "p50": "lateness, median",
    "p99": "lateness, 99th percentile",
    "p99_9": "lateness, 99.9th percentile",
    "max": "lateness, maximum",
}


def provenance(recording: Recording) -> Rows:
    """Rows of versions, database, vehicle and role map of the recording."""
    kept = {k: v for k, v in recording.description.items() if k not in ("lateness", "trial")}
    name, roles = recording.folder.name, recording.roles.title
    if roles == name:  # a table, or arrays: its channels are its own roles
        return [("Recording", name), *_flat(kept, str)]
    return [("Folder", name), ("Role map", roles), *_flat(kept, str)]


def _flat(tree: Mapping[str, Any], number: Callable[[float], str], path: str = "") -> Rows:
    rows: Rows = []
    for key, value in tree.items():
        label = f"{path} {key}".strip().replace("_", " ")
        if isinstance(value, Mapping):
            rows += _flat(value, number, label)
        elif isinstance(value, float):
            rows.append((label, number(value)))
        elif isinstance(value, str | int):
            rows.append((label, str(value)))
    return rows


def _duration(value: float) -> str:
    return f"{value * 1e6:.1f} µs" if abs(value) < 1e-3 else f"{value * 1e3:.2f} ms"
