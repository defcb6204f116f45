"""What a proposed source states beside its signal: unit, scale, radius, enumeration, unknown values."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from slipbench.protocol.binding.fields import FIELDS
from slipbench.protocol.binding.match import OWN_STATUS, REQUESTS, Match
from slipbench.protocol.binding.propose import Proposal
from slipbench.protocol.binding.words import concepts_in
from slipbench.protocol.database.layout import Message, Signal
from slipbench.protocol.recording.role_lookup import ENUMERATIONS
from slipbench.protocol.recording.roles import ROLES
from slipbench.protocol.units import linear

PERCENT = 1.5  # a share that exceeds this is a percentage
UNKNOWN = ("sna", "invalid", "unknown", "not available", "not_available", "undefined", "error")
TIMES = ("s", "ms", "us", "µs", "ns")
RADIUS = 0.3  # m, where nothing gives the radius


@dataclass(frozen=True)
class Stated:
    """One line of a role's table. check: what the user must confirm; "" where it is certain."""

    key: str
    value: str
    check: str = ""


def stated(proposal: Proposal, role: str, found: Match) -> Iterator[Stated]:
    """Lines of one role beside `signals`."""
    yield from _unit(proposal, role, found)
    if role.endswith("wheel_speed") and _converts(found.signal.unit, "rad/s"):
        yield _radius(proposal, found)
    yield from _values(role, found)
    if role.endswith("tooth_counter"):
        yield Stated("modulo", str(1 << found.signal.length))
    yield from _clock(proposal, role, found)
    unknown = _unknown(proposal, role, found)
    if unknown:
        yield Stated("unknown", f"[{', '.join(map(repr, unknown))}]", "values that mean not known")
    if role in ("optical_speed", "gnss_speed"):
        yield from _valid(found)


def lacks_unit(role: str, found: Match) -> bool:
    """Whether a role cannot be bound before the user states the unit of its signal."""
    unit = ROLES[role].unit
    return not found.signal.unit and unit not in ("1", "count") and not found.signal.choices


def _unit(proposal: Proposal, role: str, found: Match) -> Iterator[Stated]:
    signal = found.signal
    if lacks_unit(role, found):
        yield Stated(
            "unit",
            f'"{ROLES[role].unit}"',
            "the database states no unit; this one is a placeholder",
        )
    elif _is_share(role) and not signal.unit and _largest(proposal, found) > PERCENT:
        yield Stated("unit", '"%"', "the database states no unit; its values exceed 1")


def _is_share(role: str) -> bool:
    """Whether a role is a share, 0..1, of which a percentage is usual."""
    return role in FIELDS and FIELDS[role].si == ""


def _largest(proposal: Proposal, found: Match) -> float:
    """Largest value: in the capture, else as the database declares."""
    if proposal.capture is not None and proposal.traffic(found.message.name):
        values = proposal.capture.series(found.message, found.signal)[1]
        return float(np.nanmax(values)) if values.size else 0.0
    return found.signal.maximum or 0.0


def _radius(proposal: Proposal, found: Match) -> Stated:
    """Rolling radius, m: from a speed of the capture in m/s where there is one."""
    behaviour = proposal.behaviour
    if behaviour is not None and behaviour.speed is not None:
        name, speed = behaviour.speed
        turns = behaviour.on_base(found, "yaw_rate")  # rad/s
        linear_speed = not _converts(_unit_of(proposal, name), "rad/s")
        if turns is not None and linear_speed and (turns > 1).sum() > 30:
            fast = turns > 0.3 * turns.max()
            ratio = float(np.median(speed[fast] / turns[fast]))
            if 0.1 < ratio < 0.6:
                return Stated(
                    "radius", f'"{ratio:.3f} m"', f"from {name}; measure the rolling radius"
                )
    return Stated("radius", f'"{RADIUS} m"', "a placeholder: measure the rolling radius")


def _unit_of(proposal: Proposal, name: str) -> str:
    message, _, signal = name.partition(".")
    return proposal.database.message(message).signal(signal).unit


def _converts(unit: str, target: str) -> bool:
    try:
        linear(unit, target)
    except ValueError:
        return False
    return bool(unit)


def _values(role: str, found: Match) -> Iterator[Stated]:
    """Raw values of an enumeration of the bench, by the names in the database."""
    members = ENUMERATIONS.get(role)
    if members is None:
        return
    by_name = {member.name.lower(): int(member) for member in members}
    named = {raw: name.strip().lower() for raw, name in found.signal.choices.items()}
    if named and set(named.values()) <= by_name.keys():
        if any(by_name[name] != raw for raw, name in named.items()):
            yield Stated("values", _table(named))
    elif found.signal.length == 1:
        yield Stated("values", '{ "0" = "none", "1" = "throttle" }', "what each raw value means")


def _table(named: dict[int, str]) -> str:
    return "{ " + ", ".join(f'"{raw}" = "{name}"' for raw, name in sorted(named.items())) + " }"


def _clock(proposal: Proposal, role: str, found: Match) -> Iterator[Stated]:
    """The sender's own clock where its message holds one: a count in s, ms or us that wraps."""
    stamps = [
        signal
        for signal in found.message.signals
        if "time" in concepts_in(signal.name) and signal.unit in TIMES and signal.length >= 12
    ]
    if len(stamps) != 1 or stamps[0].name == found.signal.name or role in REQUESTS + OWN_STATUS:
        return
    if proposal.traffic(found.message.name) and not _runs(proposal, found.message, stamps[0]):
        return
    senders = [name for name in found.message.senders if name != "Vector__XXX"]
    name = senders[0] if len(senders) == 1 else found.message.name
    yield Stated("clock", f'"{name.lower()}"')
    yield Stated("time_signal", f'"{found.message.name}.{stamps[0].name}"')


def _runs(proposal: Proposal, message: Message, stamp: Signal) -> bool:
    """Whether a stamp advances as the time of arrival does."""
    assert proposal.capture is not None
    times, values = proposal.capture.series(message, stamp)
    turn = abs(stamp.scale) * 2.0**stamp.length
    slope, _ = linear(stamp.unit, "s")
    steps = np.diff(values) % turn * slope
    return bool(times.size > 2 and abs(np.median(steps) / np.median(np.diff(times)) - 1) < 0.1)


def _unknown(proposal: Proposal, role: str, found: Match) -> list[float]:
    """Values that mean "not known": by their names, and of a gear those above the declared range."""
    signal = found.signal
    values = {
        float(raw * signal.scale + signal.offset)
        for raw, name in signal.choices.items()
        if any(word in name.lower() for word in UNKNOWN)
    }
    if role == "gear" and signal.maximum and proposal.traffic(found.message.name):
        assert proposal.capture is not None
        observed = np.unique(proposal.capture.series(found.message, signal)[1])
        values |= {float(value) for value in observed if value > signal.maximum}
    return sorted(values)


def _valid(found: Match) -> Iterator[Stated]:
    flags = [
        signal.name
        for signal in found.message.signals
        if signal.length == 1 and "quality" in concepts_in(signal.name)
    ]
    if len(flags) == 1:
        yield Stated("valid", f'"{found.message.name}.{flags[0]}"')
