"""A binding: database, placement of the bench's messages in it, and what the bus lacks."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import get_type_hints

from slipbench.protocol.binding.bus_names import require_buses
from slipbench.protocol.binding.fields import (
    ANCHOR,
    CONSTANTS,
    FIELDS,
    NAN,
    TIMES,
    UNMONITORED,
    Field,
)
from slipbench.protocol.binding.missing import require_absent, require_roles
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import Authority
from slipbench.protocol.codec.placement import (
    BENCH_SENDS,
    KINDS,
    OWN,
    FieldsAt,
    Placement,
    SignalAt,
    TeethAt,
    buses_of,
    carriers_of,
)
from slipbench.protocol.configuration import read_toml
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.message_rules import Degraded, with_rules
from slipbench.protocol.recording.role_lookup import (
    find_message,
    find_signal,
    find_signals,
    meanings,
)
from slipbench.protocol.recording.role_map import RoleMap, Source


@dataclass(frozen=True)
class Binding:
    """Everything that the bench needs to know of its buses.

    timeouts  s, by message of the database; others are stale by the limit of the trial
    degraded  what the bus lacks
    roles, path  the binding file and its path; None for the bench's own database without one
    """

    database: Database
    placement: Placement = field(default_factory=lambda: OWN)
    timeouts: Mapping[str, float] = field(default_factory=dict)
    degraded: Degraded = field(default_factory=Degraded)
    roles: RoleMap | None = None
    path: Path | None = None

    @property
    def can_request(self) -> bool:
        """Whether the bench can send requests, or only listens."""
        return "ActuatorCommand" in self.placement

    def codec(self) -> Codec:
        """Codec of the bench's messages on this bus. Raises InputError where a signal does not suit."""
        return Codec(self.database, self.placement)

    def require_trial(self, spark: bool) -> None:
        """Check that a trial has all its roles. spark: it moves the spark advance.

        Raises InputError that names each missing role, the nearest signals, and what is lost.
        """
        if self.roles is not None:
            require_roles(self.roles, self.database, str(self.path), spark)

    @property
    def sent(self) -> frozenset[str]:
        """Messages of the database that the bench sends."""
        return frozenset(carrier for name in BENCH_SENDS for carrier in self.carriers(name))

    @property
    def buses(self) -> tuple[str, ...]:
        """Names of the buses on which roles lie, as `Codec.buses`; ("",): one without a name."""
        return buses_of(self.database, self.placement)

    def messages_on(self, bus: str) -> list[str]:
        """Messages of the database with roles on a bus."""
        held = {carrier for name in self.placement for carrier in self.carriers(name)}
        messages = self.database.messages
        return [each.name for each in messages if each.bus == bus and each.name in held]

    def carriers(self, name: str) -> set[str]:
        """Messages of the database that hold fields of a message of the bench."""
        return set(carriers_of(self.placement.get(name, {})))


def own_binding(database: Database) -> Binding:
    """Binding of the bench's own database, whose signals have the names of the fields."""
    return Binding(database)


def read_binding(path: Path, database: Path | None = None) -> Binding:
    """Read a binding file. database: in place of the one that the file names.

    Raises InputError where the file, the database or their combination is not valid.
    """
    roles = read_toml(path, RoleMap)
    known = load_database(database or database_of(roles, path), roles.bus_of)
    return bind(roles, known, path)


def database_of(roles: RoleMap, path: Path) -> Path:
    """Path of the database that a binding file names. Raises InputError where it names none."""
    if not roles.database:
        raise InputError(
            "the binding file names no database",
            where=str(path),
            expected='database = "my_motorcycle.dbc", relative to this file',
            remedy="add it, or give the database with --dbc",
        )
    return path.parent / roles.database


def bind(roles: RoleMap, database: Database, path: Path) -> Binding:
    """Binding of the roles of a file to the signals of a database.

    Raises InputError where a signal is missing or does not suit its role.
    """
    where = str(path)
    require_absent(roles, where)
    ruled = with_rules(database.on_buses(roles.bus_of), dict(roles.messages), where)
    placement = _Placed(roles, ruled, where).placement()
    require_buses(roles, ruled, placement, where)
    timeouts = {
        name: float(rule.timeout)
        for name, rule in roles.messages.items()
        if rule.timeout is not None
    }
    return Binding(ruled, placement, timeouts, roles.degraded, roles, path)


class _Placed:
    """The roles of a file, placed one by one."""

    def __init__(self, roles: RoleMap, database: Database, where: str) -> None:
        self._roles, self._database, self._where = roles, database, where
        self._sources = {role: source for role, source in roles.roles.items() if not source.column}

    def placement(self) -> Placement:
        """Placement of every message of the bench whose roles are bound."""
        found: dict[str, dict[str, SignalAt | float]] = {}
        for role, source in self._sources.items():
            if role in FIELDS and source.signals and self._used(role):
                at = FIELDS[role]
                found.setdefault(at.message, {})[at.field] = self._signal(role, source, at)
        self._brake_switch(found)
        self._complete(found)
        placement: dict[str, FieldsAt | TeethAt] = {
            name: {each.name: at[each.name] for each in fields(KINDS[name])}
            for name, at in found.items()
            if self._whole(name, at)
        }
        for wheel in ("rear", "front"):
            placement.update(self._teeth(wheel))
        self._require_once(placement)
        return placement

    def _used(self, role: str) -> bool:
        """Whether the bench uses a role that has an alternative."""
        if role == "gnss_speed":
            return self._roles.degraded.speed == "gnss"
        if role == "optical_speed":
            return self._roles.degraded.speed is None
        if role.endswith("_wheel_speed"):
            return self._roles.degraded.wheels == "wheel_speed"
        return True

    def _signal(self, role: str, source: Source, at: Field) -> SignalAt:
        message, signals = find_signals(self._database, role, source)
        if len(signals) > 1:
            raise InputError(
                "the bench reads one signal for a role",
                where=f"{self._where}: roles.{role}",
                found=", ".join(source.signals),
                remedy="bind one of them",
            )
        valid = find_signal(message, source.valid).name if source.valid else ""
        if valid and at.message == "OpticalSpeed":
            valid = ""  # a field of its own
        return SignalAt(
            message.name,
            signals[0].name,
            source.unit,
            at.si if source.radius is None else "rad/s",
            source.sign,
            source.offset,
            source.scale * (source.radius or 1.0),
            self._values(role, source, at),
            source.unknown,
            valid,
        )

    def _values(self, role: str, source: Source, at: Field) -> dict[int, int]:
        hint = get_type_hints(KINDS[at.message])[at.field]
        found = meanings(role, source, self._where)
        if found and hint is float:
            raise InputError(
                "this role is a number; `values` is for enumerations",
                where=f"{self._where}: roles.{role}",
                remedy="remove values; state unit, scale or offset instead",
            )
        return found

    def _brake_switch(self, found: dict[str, dict[str, SignalAt | float]]) -> None:
        """A brake switch counts as a brake at 100 bar where no pressure is bound."""
        rider = found.get("RiderControls", {})
        source = self._sources.get("brake")
        if source is None or {"front_brake", "rear_brake"} & rider.keys():
            return
        at = self._signal("brake", source, Field("RiderControls", "front_brake", ""))
        pressed = SignalAt(
            at.message,
            at.signal,
            at.unit,
            "",
            at.sign,
            0.0,
            at.radius * SWITCH,
            {},
            at.unknown,
            at.valid,
        )
        found.setdefault("RiderControls", {})["front_brake"] = pressed

    def _speed(self) -> Source | None:
        """Source of the speed against which the slip is taken."""
        for role in ("optical_speed", "gnss_speed"):
            if self._used(role) and role in self._sources:
                return self._sources[role]
        return None

    def _complete(self, found: dict[str, dict[str, SignalAt | float]]) -> None:
        """Add times, flags and constants."""
        self._times(found)
        self._absent(found)
        for name, constants in CONSTANTS.items():
            if name in found:
                found[name] = {**constants, **found[name]}

    def _times(self, found: dict[str, dict[str, SignalAt | float]]) -> None:
        """Place the senders' own times, and the flag of the optical sensor."""
        for name, roles in TIMES.items():
            bound = [
                self._sources[role] for role in roles if role in self._sources and self._used(role)
            ]
            source = next((each for each in bound if each.time_signal), None)
            if source is not None and name in found:
                message, signal = self._named(source.time_signal)
                found[name]["time"] = SignalAt(message, signal, to="s")
        speed = self._speed()
        if speed is not None and speed.valid and "OpticalSpeed" in found:
            found["OpticalSpeed"]["valid"] = SignalAt(*self._named(speed.valid))

    def _named(self, name: str) -> tuple[str, str]:
        """Message and signal of "Message.signal"."""
        message = find_message(self._database, name.partition(".")[0])
        return message.name, find_signal(message, name).name

    def _absent(self, found: dict[str, dict[str, SignalAt | float]]) -> None:
        """Hold constant what no signal gives and [degraded] accepts; the gateway replaces some of it."""
        degraded = self._roles.degraded
        held: list[tuple[str, str, float]] = [
            UNMONITORED[name] for name in degraded.unmonitored if name in UNMONITORED
        ]
        if degraded.hand_back is not None:
            held += [
                ("EcuStatus", "authority", Authority.NONE),
                ("ActuatorCommand", "authority", Authority.THROTTLE),
            ]
        if degraded.echo is not None:
            held.append(("EcuStatus", "throttle_command", NAN))
        if degraded.throttle_body is not None:
            held.append(("ThrottleStatus", "authority", Authority.NONE))
        for name, key, value in held:
            if name in found:
                found[name].setdefault(key, value)

    def _whole(self, name: str, at: Mapping[str, SignalAt | float]) -> bool:
        return {each.name for each in fields(KINDS[name])} <= at.keys()

    def _teeth(self, wheel: str) -> Iterator[tuple[str, FieldsAt | TeethAt]]:
        source = self._sources.get(f"{wheel}_teeth")
        if source is None or self._roles.degraded.wheels is not None:
            return
        message = find_message(self._database, source.teeth)
        names = {key: key for key in ("layout", "tooth_count")} | dict(source.names)
        for signal in names.values():
            find_signal(message, f"{message.name}.{signal}")
        yield (
            f"{wheel.capitalize()}Teeth",
            TeethAt(message.name, names["layout"], names["tooth_count"]),
        )
        anchor = find_message(self._database, source.anchor)
        own = {key: source.anchor_names.get(key, key) for key in ANCHOR}
        yield (
            f"{wheel.capitalize()}EncoderStatus",
            {
                key: SignalAt(
                    anchor.name,
                    find_signal(anchor, f"{anchor.name}.{signal}").name,
                    to="s" if key == "tooth_time" else None,
                )
                for key, signal in own.items()
            },
        )

    def _require_once(self, placement: Placement) -> None:
        """Check that no signal has two roles, and that the bench sends no message that it receives."""
        taken: dict[tuple[str, str], str] = {}
        carriers: dict[str, str] = {}
        for name, at in placement.items():
            if isinstance(at, TeethAt):
                self._require_other_sender(carriers, at.message, name)
                continue
            for key, place in at.items():
                if not isinstance(place, SignalAt):
                    continue
                self._require_other_sender(carriers, place.message, name)
                before = taken.setdefault((place.message, place.signal), f"{name}.{key}")
                if before != f"{name}.{key}" and key != "time":
                    raise InputError(
                        f"{place.message}.{place.signal} is bound to two roles",
                        where=self._where,
                        found=f"{_role(before)} and {_role(f'{name}.{key}')}",
                        remedy="bind each role to a signal of its own",
                    )

    def _require_other_sender(self, carriers: dict[str, str], carrier: str, name: str) -> None:
        sender = "the bench" if name in BENCH_SENDS else "the motorcycle"
        if carriers.setdefault(carrier, sender) != sender:
            raise InputError(
                f"message {carrier} is bound to roles that the bench sends and to roles that it receives",
                where=self._where,
                expected="one sender for each message",
                remedy="bind the requests to a message that only the bench sends",
            )


SWITCH = 1e7  # Pa, what a closed brake switch counts as


def _role(place: str) -> str:
    """Role of "Message.field"."""
    found = [role for role, at in FIELDS.items() if f"{at.message}.{at.field}" == place]
    return found[0] if found else place
