"""Refuse a database that would decode frames to wrong values, and name all its faults."""

from collections.abc import Iterator, Mapping
from itertools import combinations

from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.errors import InputError

FD_LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)  # bytes that a CAN (FD) frame can carry
MOST_FAULTS = 10


def check(database: Database) -> None:
    """Raise InputError where messages or signals contradict each other."""
    faults = list(_faults(database))
    if faults:
        more = [f"and {len(faults) - MOST_FAULTS} more"] if len(faults) > MOST_FAULTS else []
        raise InputError(
            "; ".join([*faults[:MOST_FAULTS], *more]),
            where=database.origin,
            remedy="correct the start bits and lengths of the signals named, or the identifiers",
        )


def _faults(database: Database) -> Iterator[str]:
    yield from _doubled(database)
    for message in database.messages:
        yield from _misfits(message)
        yield from _overlaps(message)


def _doubled(database: Database) -> Iterator[str]:
    names: set[str] = set()
    frames: dict[tuple[int, bool], dict[str, str]] = {}
    for message in database.messages:
        if message.name in names:
            yield f"messages {message.name} and {message.name} share the name {message.name}"
        names.add(message.name)
        on_bus = frames.setdefault((message.identifier, message.extended), {})
        other = _meeting(on_bus, message.bus)
        if other is not None:
            yield f"messages {other} and {message.name} share identifier {message.identifier:#x}"
        on_bus[message.bus] = message.name


def _meeting(on_bus: dict[str, str], bus: str) -> str | None:
    """Message of the same identifier that can come on the same bus; "" is any bus."""
    if not bus:
        return next(reversed(on_bus.values()), None)
    return on_bus.get(bus, on_bus.get(""))


def _misfits(message: Message) -> Iterator[str]:
    top = 0x1FFFFFFF if message.extended else 0x7FF
    if not 0 <= message.identifier <= top:
        yield f"message {message.name}: identifier {message.identifier:#x} is above {top:#x}"
    if message.length not in FD_LENGTHS:
        yield f"message {message.name}: no CAN frame carries {message.length} bytes"
    if len(message.by_name) < len(message.signals):
        yield f"message {message.name}: two signals have the same name"
    for signal in message.signals:
        yield from _misfit(message, signal)


def _misfit(message: Message, signal: Signal) -> Iterator[str]:
    where = f"message {message.name}, signal {signal.name}"
    last = signal.first_bit + signal.length
    if not 1 <= signal.length <= 64:
        yield f"{where}: {signal.length} bits, expected 1 to 64"
    if signal.is_float and signal.length not in (16, 32, 64):
        yield f"{where}: a float of {signal.length} bits, expected 16, 32 or 64"
    if last > 8 * message.length:
        yield f"{where}: ends at bit {last}, but the message has {8 * message.length}"
    if signal.scale == 0:
        yield f"{where}: scale 0"
    if signal.multiplexer is not None and signal.multiplexer not in message.by_name:
        yield f"{where}: its multiplexer {signal.multiplexer} is missing"


def _overlaps(message: Message) -> Iterator[str]:
    bits = {signal.name: _bits(signal) for signal in message.signals}
    for one, other in combinations(message.signals, 2):
        shared = bits[one.name] & bits[other.name]
        if shared and _can_meet(message, one, other):
            where = (shared & -shared).bit_length() - 1
            pair = f"signals {one.name} and {other.name}"
            yield f"message {message.name}: {pair} overlap at bit {where}"


def _bits(signal: Signal) -> int:
    """Mask of the bits of a signal, in little-endian numbering."""
    if signal.little_endian:
        return ((1 << signal.length) - 1) << signal.start
    first = signal.first_bit
    sent = range(first, first + signal.length)
    return sum(1 << (8 * (bit // 8) + 7 - bit % 8) for bit in sent)


def _can_meet(message: Message, one: Signal, other: Signal) -> bool:
    mine, theirs = _conditions(message, one), _conditions(message, other)
    return all(mine[name] & theirs[name] for name in mine.keys() & theirs.keys())


def _conditions(message: Message, signal: Signal) -> Mapping[str, frozenset[int]]:
    """Raw values that every multiplexer above a signal must have for it to be present."""
    conditions: dict[str, frozenset[int]] = {}
    while signal.multiplexer is not None and signal.multiplexer not in conditions:
        conditions[signal.multiplexer] = frozenset(signal.multiplexer_ids)
        if signal.multiplexer not in message.by_name:
            break
        signal = message.by_name[signal.multiplexer]
    return conditions
