"""Every role of a binding as the bus shows it: value, age, rate, faults."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from slipbench.bench.check.traffic import BusTraffic
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.binding.fields import FIELDS
from slipbench.protocol.codec.faults import Fault
from slipbench.protocol.codec.placement import BENCH_SENDS
from slipbench.protocol.database.layout import Message, Signal
from slipbench.protocol.logs.decode import Frames
from slipbench.protocol.recording.role_lookup import find_message, find_signals, to_si
from slipbench.protocol.recording.role_map import RoleMap, Source

Array = npt.NDArray[np.float64]

PERIODS = 10  # cycle times after which a message is silent
LONGEST = 1.0  # s, after which a message without a cycle time is silent
FAULTY = 0.01  # share of frames with a fault from which a role is faulty


@dataclass(frozen=True)
class RoleStatus:
    """One role on the bus.

    value   as shown, in the unit of the database or the binding; "" where nothing came
    age     s, since the last frame; None where none came
    rate    frames per second
    faults  frames by fault
    state   "live", "silent", "never received" or "faulty"
    """

    role: str
    signals: str
    state: str
    value: str = ""
    age: float | None = None
    rate: float = 0.0
    faults: Mapping[str, int] | None = None

    @property
    def is_live(self) -> bool:
        """Whether the bench can use the role."""
        return self.state == "live"


def observed_roles(binding: Binding, traffic: BusTraffic) -> list[RoleStatus]:
    """Status of every role that the motorcycle sends, in the order of the binding file."""
    return [
        _status(binding, traffic, role, source)
        for role, source in roles_of(binding).roles.items()
        if not source.column and not is_sent_by_bench(role)
    ]


def roles_of(binding: Binding) -> RoleMap:
    """Role map of a binding that was read from a file."""
    assert binding.roles is not None
    return binding.roles


def is_sent_by_bench(role: str) -> bool:
    """Whether the bench sends a role: a request, or the state of its trial."""
    return role in FIELDS and FIELDS[role].message in BENCH_SENDS


def carrier(binding: Binding, source: Source) -> Message:
    """Message of the database that holds a role."""
    name = source.teeth or source.signals[0].partition(".")[0]
    return find_message(binding.database, name)


def _status(binding: Binding, traffic: BusTraffic, role: str, source: Source) -> RoleStatus:
    message = carrier(binding, source)
    frames = traffic.sorted.frames[message.name]
    names = ", ".join(source.signals) or message.name
    faults = dict(_faults(traffic, message.name))
    if not len(frames):
        return RoleStatus(role, names, "never received", faults=faults)
    age = traffic.age(message.name)
    rate = traffic.rate(message.name)
    value = _shown(frames, source) if source.signals else f"{len(frames)} frames"
    if source.signals:
        faults |= _out_of_range(binding, traffic, role, source)
    state = "live"
    if age > allowed_silence(binding, message, rate):
        state = "silent"
    elif _is_faulty(faults, len(frames)):
        state = "faulty"
    return RoleStatus(role, names, state, value, age, rate, faults)


def allowed_silence(binding: Binding, message: Message, rate: float = 0.0) -> float:
    """Time without a frame, s, after which a message is silent. rate: 1/s, measured."""
    stated = binding.timeouts.get(message.name)
    if stated is not None and message.cycle_time is not None:
        return max(stated, 2 * message.cycle_time)
    if message.cycle_time is not None:
        return PERIODS * message.cycle_time
    return max(LONGEST, PERIODS / rate if rate else LONGEST)


def _is_faulty(faults: Mapping[str, int], frames: int) -> bool:
    serious = sum(
        count for fault, count in faults.items() if fault not in (Fault.LOST, Fault.STALE)
    )
    return serious > FAULTY * frames


def _faults(traffic: BusTraffic, message: str) -> Iterator[tuple[str, int]]:
    for fault in traffic.faults:
        if fault.message == message and fault.fault != Fault.RANGE:
            yield fault.fault, fault.count


def _out_of_range(
    binding: Binding, traffic: BusTraffic, role: str, source: Source
) -> dict[str, int]:
    """Samples outside the range that the database declares; values that mean "not known" are none."""
    message, signals = find_signals(binding.database, role, source)
    count = sum(_outside(traffic, message, signal, source) for signal in signals)
    return {str(Fault.RANGE): count} if count else {}


def _outside(traffic: BusTraffic, message: Message, signal: Signal, source: Source) -> int:
    if signal.minimum is None or signal.maximum is None or signal.minimum >= signal.maximum:
        return 0
    value = np.asarray(traffic.sorted.frames[message.name].samples(signal.name).value, np.float64)
    step = abs(signal.scale) / 2
    outside = (value < signal.minimum - step) | (value > signal.maximum + step)
    return int(np.count_nonzero(outside & ~np.isin(value, source.unknown)))


def values_of(binding: Binding, traffic: BusTraffic, role: str) -> tuple[Array, Array]:
    """Times (s since the first frame) and values (SI) of a role, (n,) each; averaged signals."""
    roles = roles_of(binding)
    source = roles.roles[role]
    message, signals = find_signals(binding.database, role, source)
    frames = traffic.sorted.frames[message.name]
    samples = [frames.samples(signal.name) for signal in signals]
    known = np.ones(samples[0].rows.size, np.bool_)
    for each in samples:
        known &= np.isfinite(np.asarray(each.value, np.float64))
        known &= ~np.isin(each.value, source.unknown)
    converted = [
        to_si(each.value, signal.unit, role, source, roles.unit(role))
        for each, signal in zip(samples, signals, strict=True)
    ]
    return traffic.times(samples[0].rows)[known], np.mean(converted, axis=0)[known]


def _shown(frames: Frames, source: Source) -> str:
    """Last value, in the unit of the binding or the database, or its name."""
    parts = []
    for name in source.signals:
        found = frames.samples(name.partition(".")[2])
        if not found.rows.size:
            return "not in the frames that came"
        signal, raw = found.signal, found.raw[-1]
        label = signal.choices.get(int(raw)) if not signal.is_float else None
        unit = source.unit if source.unit is not None else signal.unit
        parts.append(label or f"{found.value[-1]:.6g} {unit}".strip())
    return ", ".join(parts)
