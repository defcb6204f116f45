"""Roles that a trial needs and a binding lacks: each with the nearest signals and the way out."""

from collections.abc import Iterator
from dataclasses import dataclass

from slipbench.protocol.binding.match import nearest
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.message_rules import Degraded
from slipbench.protocol.recording.role_map import RoleMap


@dataclass(frozen=True)
class Need:
    """A role that a trial needs.

    without   what the trial cannot do without it
    instead   entry of [degraded] that accepts its absence; "" where nothing does
    """

    role: str
    without: str
    instead: str = ""


def needs(degraded: Degraded, bound: set[str], spark: bool) -> Iterator[Need]:
    """Roles that a trial needs, those that [degraded] replaces left out. spark: the trial moves it."""
    yield Need("rider_button", "the rider cannot begin and end the trial")
    yield Need("rider_grip", "a closing grip does not end the trial")
    yield Need("engine_speed", "the operating point and the limits of engine speed are unknown")
    yield Need("throttle_position", "the throttle body cannot be monitored")
    yield Need("throttle_request", "the bench can only listen")
    if spark:
        yield Need("spark_request", "the bench cannot move the spark advance")
    if degraded.hand_back is None:
        way = 'hand_back = "20 ms", the time after which the ECU takes the throttle back'
        yield Need("authority_request", "the bench cannot request or release authority", way)
        yield Need("authority", "the bench cannot know whether the ECU grants authority", way)
    if degraded.echo is None:
        way = 'echo = "5 ms", the latency after which a request counts as applied'
        yield Need("throttle_command", "the bench does not know what the ECU commands", way)
    if degraded.throttle_body is None:
        yield Need(
            "throttle_authority",
            "the bench cannot know whether the throttle body grants authority",
            'throttle_body = "follows_ecu"',
        )
    yield from _unmonitored(degraded, bound)
    yield from _motion(degraded)


def _unmonitored(degraded: Degraded, bound: set[str]) -> Iterator[Need]:
    for role, name, without in (
        ("gear", "gear", "a change of gear does not end the trial"),
        ("clutch", "clutch", "a pulled clutch does not end the trial"),
        ("throttle_fault", "throttle_fault", "a fault of the throttle body does not end the trial"),
    ):
        if name not in degraded.unmonitored:
            yield Need(role, without, f'unmonitored = ["{name}"]')
    brakes = {"front_brake_pressure", "rear_brake_pressure", "brake"}
    if not brakes & bound and "brake" not in degraded.unmonitored:
        yield Need("brake", "braking does not end the trial", 'unmonitored = ["brake"]')


def _motion(degraded: Degraded) -> Iterator[Need]:
    for wheel in ("rear", "front"):
        if degraded.wheels is None:
            way = 'wheels = "wheel_speed", with the roles rear_wheel_speed and front_wheel_speed'
            yield Need(f"{wheel}_teeth", "the slip is unknown", way)
        else:
            yield Need(f"{wheel}_wheel_speed", "the slip is unknown")
    if degraded.speed is None:
        way = 'speed = "front_wheel" or speed = "gnss"'
        yield Need("optical_speed", "the slip is unknown", way)
    elif degraded.speed == "gnss":
        yield Need("gnss_speed", "the slip is unknown")


def missing_roles(roles: RoleMap, spark: bool) -> list[Need]:
    """Roles that a trial needs and the file does not bind."""
    bound = {role for role, source in roles.roles.items() if not source.column}
    return [need for need in needs(roles.degraded, bound, spark) if need.role not in bound]


def require_roles(roles: RoleMap, database: Database, where: str, spark: bool = False) -> None:
    """Raise InputError that names every role that a trial lacks, with the nearest signals."""
    missing = missing_roles(roles, spark)
    if not missing:
        return
    lines = [
        f"{need.role}: without it {need.without}; nearest: {nearest(database, need.role)}"
        + (f"; or accept it under [degraded]: {need.instead}" if need.instead else "")
        for need in missing
    ]
    raise InputError(
        f"the binding lacks {len(missing)} role{'s' * (len(missing) > 1)} that a trial needs:\n  "
        + "\n  ".join(lines),
        where=where,
        remedy="bind these roles, or accept their absence under [degraded]",
    )


def require_absent(roles: RoleMap, where: str) -> None:
    """Check that [degraded] accepts the absence of no role that the file binds.

    The bench would assume a value that a signal measures. Raises InputError that names the role.
    """
    for entry, role in _replaced(roles.degraded):
        if role in roles.roles and not roles.roles[role].column:
            raise InputError(
                f"degraded.{entry} states that no signal gives {role}, and roles.{role} binds one",
                where=where,
                expected=f"degraded.{entry} or roles.{role}",
                found="both",
                remedy=f"remove degraded.{entry}, or unbind the role",
            )


def _replaced(degraded: Degraded) -> Iterator[tuple[str, str]]:
    """Entries of [degraded], each with a role that it replaces."""
    if degraded.hand_back is not None:
        yield "hand_back", "authority"
    if degraded.echo is not None:
        yield "echo", "throttle_command"
    if degraded.throttle_body is not None:
        yield "throttle_body", "throttle_authority"
    for name in degraded.unmonitored:
        yield "unmonitored", name
        if name == "brake":
            yield "unmonitored", "front_brake_pressure"
            yield "unmonitored", "rear_brake_pressure"
