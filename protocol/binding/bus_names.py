"""Buses that a binding names: each message lies on one, and each role on that of its message."""

from slipbench.protocol.codec.placement import Placement, carriers_of
from slipbench.protocol.database.layout import Database
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.role_map import RoleMap


def require_buses(roles: RoleMap, database: Database, placement: Placement, where: str) -> None:
    """Check that either every message with a role has a bus, or none.

    Raises InputError where one has none beside others, or a role names another bus than its message.
    """
    _require_all(database, placement, where)
    for role, source in roles.roles.items():
        for name in {each.partition(".")[0] for each in (*source.signals, source.teeth) if each}:
            bus = roles.bus_of(name)
            if source.bus and bus and source.bus != bus:
                raise InputError(
                    f"role {role} and its message {name} are on different buses",
                    where=where,
                    expected=f"roles.{role}.bus = {bus!r}, that of the message",
                    found=repr(source.bus),
                    remedy=f"remove roles.{role}.bus, or correct messages.{name}.bus",
                )


def _require_all(database: Database, placement: Placement, where: str) -> None:
    held = {carrier for at in placement.values() for carrier in carriers_of(at)}
    placed = [message for message in database.messages if message.name in held]
    named = {message.bus for message in placed if message.bus}
    without = [message.name for message in placed if not message.bus]
    if named and without:
        raise InputError(
            f"no bus is named for {', '.join(without)}",
            where=where,
            expected="a bus for every message that has a role, where one of them names its bus",
            found=f"buses {', '.join(sorted(named))}",
            remedy=f'add bus = "{min(named)}" to [messages.{without[0]}], or once above all tables',
        )
