"""Make channels of frames and tables: one for each role that has samples."""

from collections.abc import Mapping
from dataclasses import dataclass

from slipbench.protocol.database.layout import Database
from slipbench.protocol.logs.decode import SortedLog
from slipbench.protocol.recording.bus_channels import BusLog, BusSamples, Missing
from slipbench.protocol.recording.channel import Channel
from slipbench.protocol.recording.device_clocks import align_clocks
from slipbench.protocol.recording.recording import BusFault
from slipbench.protocol.recording.role_map import RoleMap
from slipbench.protocol.recording.sender_check import TWO_SENDERS, alternates
from slipbench.protocol.recording.table_channels import Span, TableLog
from slipbench.protocol.tables import Table

_TWO_SERIES = (
    "its values alternate between two time series; if two vehicles were on one bus, split the log"
)


@dataclass(frozen=True)
class Bound:
    """Channels of a recording, and the roles without samples.

    missing  role -> why there are no samples of it
    faults   messages whose values come from two senders, where no counter shows it
    """

    channels: Mapping[str, Channel]
    missing: Mapping[str, str]
    warnings: tuple[str, ...]
    faults: tuple[BusFault, ...] = ()


def start_of(sorted_log: SortedLog | None, tables: Mapping[str, Table], roles: RoleMap) -> int:
    """Start of a recording in ns: its first frame, or the first row of its tables."""
    if sorted_log is not None and len(sorted_log.log):
        return int(sorted_log.log.time_ns[0])
    return round(TableLog(tables, roles, None).start() * 1e9)


def bind(
    sorted_log: SortedLog | None,
    database: Database | None,
    tables: Mapping[str, Table],
    roles: RoleMap,
    start_ns: int,
) -> Bound:
    """Channels of every role in the map. Raises InputError where the map does not suit the data."""
    missing: dict[str, str] = {}
    warnings: dict[str, None] = {}
    faults: dict[str, BusFault] = {}
    channels = _from_bus(sorted_log, database, roles, start_ns, missing, faults)
    side = TableLog(tables, roles, _span(sorted_log))
    for role, source in roles.roles.items():
        if source.column:
            try:
                channels[role], found = side.channel(role, source, start_ns * 1e-9)
                warnings |= dict.fromkeys(found)
            except Missing as why:
                missing[role] = str(why)
    ordered = {role: channels[role] for role in roles.roles if role in channels}
    return Bound(ordered, missing, tuple(warnings), tuple(faults.values()))


def _span(sorted_log: SortedLog | None) -> Span | None:
    if sorted_log is None or not len(sorted_log.log):
        return None
    times = sorted_log.log.time_ns
    return Span(times[0] * 1e-9, times[-1] * 1e-9)


def _from_bus(
    sorted_log: SortedLog | None,
    database: Database | None,
    roles: RoleMap,
    start_ns: int,
    missing: dict[str, str],
    faults: dict[str, BusFault],
) -> dict[str, Channel]:
    bound = {role: source for role, source in roles.roles.items() if not source.column}
    if sorted_log is None or database is None:
        missing |= dict.fromkeys(bound, "the recording has no frames, only tables")
        return {}
    log = BusLog(sorted_log, database, start_ns)
    found: dict[str, BusSamples] = {}
    for role, source in bound.items():
        try:
            samples = log.samples(role, source, roles.unit(role))
        except Missing as why:
            missing[role] = str(why)
            continue
        message = (source.teeth or source.signals[0]).partition(".")[0]
        counted = log.sorted_log.frames[message].counter_period > 0
        if not counted and alternates(samples.value):
            missing[role] = f"{TWO_SENDERS}: {_TWO_SERIES}"
            faults[message] = BusFault(
                message, TWO_SENDERS, samples.value.size, float(samples.arrival[0])
            )
            continue
        found[role] = samples
    aligned = align_clocks(found, {role: bound[role].clock for role in found})
    return {role: _channel(role, aligned[role], roles) for role in found}


def _channel(role: str, samples: BusSamples, roles: RoleMap) -> Channel:
    source, unit = roles.roles[role], roles.unit(role)
    if samples.device is None:
        time = samples.arrival - source.delay
        return Channel(role, time, samples.value, unit, "bus", samples.origin)
    return Channel(
        role,
        samples.device - source.delay,
        samples.value,
        unit,
        source.clock,
        samples.origin,
        samples.arrival,
    )
