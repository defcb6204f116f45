"""The frames of an exported motorcycle on CAN, from a role map and its database.

The motorcycle reads the messages that command it, and sends those that show how it moves.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from slipbench.plant.fmu.bus import PLAIN, TIME, Bus, BusFrame, BusProtection, BusSignal, named
from slipbench.protocol.binding.binding import database_of
from slipbench.protocol.codec.protection import HEADERS, Plain, guard_of
from slipbench.protocol.codec.slot import limits
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database, Message, Signal
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.message_rules import with_rules
from slipbench.protocol.recording.role_lookup import find_signals, to_si
from slipbench.protocol.recording.role_map import RoleMap, Source
from slipbench.protocol.units import linear

if TYPE_CHECKING:
    from slipbench.plant.motorcycle import Motorcycle

NAME, VERSION = "CAN", 3
READ = {
    "throttle_command": "throttle_command",
    "spark_command": "spark",
    "throttle_request": "throttle_command",
    "spark_request": "spark",
}
"""Variable of each role that commands the motorcycle; requests only where nothing echoes them."""
ECHOES = {"throttle_request": "throttle_command", "spark_request": "spark_command"}


@dataclass(frozen=True)
class BoundBus:
    """A bus, and what is not on it. left_out: reason by message; constant: signals without a variable."""

    bus: Bus
    left_out: Mapping[str, str]
    constant: tuple[str, ...]


def read_bus(path: Path, motorcycle: "Motorcycle", dbc: Path | None = None) -> BoundBus:
    """Return the bus of a role map. dbc: database in place of the one that it names.

    Raises InputError where it does not suit an FMU.
    """
    roles = read_toml(path, RoleMap)
    database = load_database(dbc or database_of(roles, path), roles.bus_of)
    ruled = with_rules(database.on_buses(roles.bus_of), dict(roles.messages), str(path))
    return bind_bus(roles, ruled, motorcycle, str(path))


def bind_bus(roles: RoleMap, database: Database, motorcycle: "Motorcycle", where: str) -> BoundBus:
    """Return the bus of roles in a database. where: the file that an error names.

    Raises InputError where it does not suit an FMU.
    """
    return _Bound(roles, database, motorcycle, where).bus()


def require_bus(fmi: int, roles: Path | None, dbc: Path | None = None) -> None:
    """Raise InputError for a database without roles, and for frames in FMI 2.0, without clocks."""
    if dbc is not None and roles is None:
        raise InputError(
            "--dbc has no effect without a role map", remedy="name the role map as well: --bus FILE"
        )
    if roles is not None and fmi != VERSION:
        raise InputError(
            "CAN frames need clocks, which FMI 2.0 does not have",
            where="--bus",
            expected="FMI 3.0",
            found=f"--fmi {fmi}",
            remedy="leave --fmi out",
        )


def words(bound: BoundBus) -> Iterator[str]:
    """Yield what is on the bus, and what is not, for a person."""
    frames = bound.bus.frames
    for verb, some in (
        ("sends", [frame for frame in frames if frame.period > 0.0]),
        ("reads", [frame for frame in frames if frame.period == 0.0]),
    ):
        yield f"{bound.bus.name} (FMI-LS-BUS) {verb}: {named(some) or 'nothing'}"
    if bound.constant:
        yield f"constant in its frames, since it does not simulate them: {', '.join(bound.constant)}"
    for reason in dict.fromkeys(bound.left_out.values()):
        messages = [name for name, why in bound.left_out.items() if why == reason]
        yield f"not in it, since {reason}: {', '.join(messages)}"


def _sent_roles(motorcycle: "Motorcycle") -> dict[str, tuple[str, float]]:
    """Variable of each role that the motorcycle shows, and its factor."""
    rear, front = motorcycle.rear_wheel.radius, motorcycle.front_wheel.radius
    same = {
        "throttle_position": "throttle",
        "engine_speed": "engine_speed",
        "gear": "gear",
        "optical_speed": "optical_speed",
        "gnss_speed": "speed",
        "longitudinal_acceleration": "acceleration",
        "lean_angle": "lean",
    }
    wheels = {"rear_wheel_speed": ("rear_speed", rear), "front_wheel_speed": ("front_speed", front)}
    return {**{role: (variable, 1.0) for role, variable in same.items()}, **wheels}


class _Bound:
    """Roles, the messages of the database, and the variables of the motorcycle."""

    def __init__(
        self, roles: RoleMap, database: Database, motorcycle: "Motorcycle", where: str
    ) -> None:
        self._roles, self._database, self._where = roles, database, where
        self._shown = _sent_roles(motorcycle)
        self._sources: dict[str, dict[str, tuple[str, Source]]] = {}
        self._teeth = {
            name for source in roles.roles.values() for name in (source.teeth, source.anchor)
        }
        for role, source in roles.roles.items():
            if source.signals:
                message, signals = find_signals(database, role, source)
                for signal in signals:
                    self._sources.setdefault(message.name, {})[signal.name] = (role, source)

    def bus(self) -> BoundBus:
        """Return the frames; raises InputError where none is sent or read."""
        left_out: dict[str, str] = {}
        frames, buses = [], set()
        for message in sorted(self._database.messages, key=lambda m: m.identifier):
            found = self._frame(message)
            if isinstance(found, str):
                left_out[message.name] = found
            elif found is not None:
                frames.append(found)
                buses.add(message.bus)
        self._require(frames, buses)
        constant = tuple(_without_variable(frames, self._database))
        bitrate = round(self._roles.bitrate or 0)
        return BoundBus(Bus(NAME, tuple(frames), bitrate), left_out, constant)

    def _require(self, frames: list[BusFrame], buses: set[str]) -> None:
        if not frames:
            raise InputError(
                "no message of the role map has a role of the motorcycle",
                where=self._where,
                expected=f"one of {', '.join((*READ, *self._shown))}",
                found=", ".join(self._roles.roles),
                remedy="bind a signal to one of them",
            )
        if len(buses) > 1:
            raise InputError(
                "the roles of the motorcycle lie on several buses",
                where=self._where,
                expected="one bus",
                found=", ".join(sorted(buses)),
                remedy="write a role map for each bus, and export an FMU with each",
            )

    def _frame(self, message: Message) -> BusFrame | str | None:
        """Return a frame, why there is none, or None where no role of it is known."""
        bound = self._sources.get(message.name, {})
        reads = {name: role for name, (role, _) in bound.items() if self._is_read(role)}
        shows = [role for role, _ in bound.values() if role in self._shown]
        if message.name in self._teeth:
            return "they hold tooth times"
        if not reads and not shows:
            return "they have no role of the motorcycle" if bound else None
        if any(signal.multiplexer or signal.is_multiplexer for signal in message.signals):
            return "they are multiplexed"
        if odd := next((s for s in message.signals if s.is_float and s.length == 16), None):
            return f"{odd.name} is a floating-point number of 16 bits"
        period = 0.0 if reads else message.cycle_time
        if period is None:
            raise InputError(
                f"message {message.name} states no cycle time",
                where=self._where,
                remedy=f'[messages.{message.name}]\ncycle_time = "10 ms"',
            )
        signals = tuple(self._signal(message, s, bool(reads)) for s in message.signals)
        protection = _protection(message)
        return BusFrame(
            message.name,
            message.identifier,
            message.length,
            signals,
            period,
            message.extended,
            message.fd,
            protection,
        )

    def _is_read(self, role: str) -> bool:
        return role in READ and ECHOES.get(role) not in self._roles.roles

    def _signal(self, message: Message, signal: Signal, read: bool) -> BusSignal:
        name, bits = f"{message.name}.{signal.name}", _bits(signal)
        if not read and self._is_time(name):
            tick = signal.scale * linear(signal.unit, "s")[0]
            return BusSignal(name, bits, TIME, tick, wraps=True)
        bound = self._sources.get(message.name, {}).get(signal.name)
        variable, factor = self._variable(bound[0], read) if bound else ("", 1.0)
        if bound is None or not variable or bound[1].values:
            return BusSignal(name, bits, fixed=self._fixed(message, signal))
        role, source = bound
        at = np.array([signal.offset, signal.offset + signal.scale], np.float64)
        zero, one = to_si(at, signal.unit, role, source, self._roles.unit(role)) / factor
        low, high = limits(signal)
        kind = (signal.signed, signal.is_float, signal.wraps)
        return BusSignal(name, bits, variable, float(one - zero), float(zero), *kind, low, high)

    def _variable(self, role: str, read: bool) -> tuple[str, float]:
        """Variable of a role and its factor; empty where the role is neither read nor sent."""
        if read:
            return (READ[role] if self._is_read(role) else ""), 1.0
        return self._shown.get(role, ("", 1.0))

    def _is_time(self, name: str) -> bool:
        return any(source.time_signal == name for source in self._roles.roles.values())

    def _fixed(self, message: Message, signal: Signal) -> int:
        """Raw value of a signal without a variable: 1 if it says valid, its start, or that of 0."""
        name = f"{message.name}.{signal.name}"
        if any(source.valid == name for source in self._roles.roles.values()):
            return 1
        if signal.is_float:
            return 0
        low, high = limits(signal)
        rest = min(max(round(-signal.offset / signal.scale), low), high)
        raw = rest if signal.start_value is None else signal.start_value
        return int(raw) & ((1 << signal.length) - 1)


def _bits(signal: Signal) -> tuple[int, ...]:
    """Positions of a signal's bits, the lowest first."""
    if signal.little_endian:
        return tuple(range(signal.start, signal.start + signal.length))
    sent = range(signal.first_bit, signal.first_bit + signal.length)  # the highest first
    return tuple(8 * (bit // 8) + 7 - bit % 8 for bit in reversed(sent))


def _protection(message: Message) -> BusProtection | None:
    rule, guard = message.protection, guard_of(message)
    if rule is None or guard is None:
        return None
    if not isinstance(guard, Plain):
        ids = rule.data_ids if rule.profile == 2 else rule.data_id.to_bytes(2, "little")
        return BusProtection(rule.profile, guard.period, ids)
    counter = _bits(message.signal(rule.counter)) if rule.counter else ()
    if rule.checksum is None:
        return BusProtection(PLAIN, guard.period, counter=counter)
    how = rule.checksum
    numbers = (how.kind, how.polynomial, how.start, how.final_xor)
    return BusProtection(PLAIN, guard.period, b"", counter, guard.place, *numbers)


def _without_variable(frames: list[BusFrame], database: Database) -> Iterator[str]:
    """Yield signals of sent frames that are constant, without counters and checksums."""
    for frame in frames:
        written = _written(database.by_name[frame.name])
        for signal in frame.signals if frame.period > 0.0 else ():
            if not signal.variable and signal.name not in written:
                yield signal.name


def _written(message: Message) -> set[str]:
    """Signals of a message that hold its counter and checksum."""
    rule = message.protection
    if rule is None:
        return set()
    header = range(HEADERS[rule.profile][1] if rule.profile in HEADERS else 0)
    names = {signal.name for signal in message.signals if min(_bits(signal)) in header}
    names |= {rule.counter, rule.checksum.signal if rule.checksum else ""}
    return {f"{message.name}.{name}" for name in names}
