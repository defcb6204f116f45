"""A binding proposed from a database, and from a capture where there is one."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

from slipbench.protocol.binding.behaviour import Behaviour
from slipbench.protocol.binding.capture import Captured, Traffic
from slipbench.protocol.binding.fields import FIELDS
from slipbench.protocol.binding.match import LEAST, NEEDED, OWN_STATUS, REQUESTS, Match, matches
from slipbench.protocol.binding.tooth_messages import ToothMessage, tooth_messages
from slipbench.protocol.database.layout import Database, Message

LOOKED_AT = 12  # signals of a role, by name, whose behaviour is looked at
RUNNERS_UP = 3
CLOSE = 0.05  # difference of scores from which the second is named as close
SENT = (*REQUESTS, *OWN_STATUS)


@dataclass(frozen=True)
class Chosen:
    """Proposal for one role: the best signal if any is good enough, and the next ones."""

    role: str
    best: Match | None
    others: tuple[Match, ...]

    @property
    def is_close(self) -> bool:
        """Whether the second signal is nearly as good."""
        return bool(self.best and self.others and self.best.score - self.others[0].score < CLOSE)


@dataclass(frozen=True)
class Proposal:
    """A binding that the user confirms by editing it.

    roles    by role, in the order of the binding file; those without a signal too
    teeth    tooth messages by wheel
    capture  what it was also measured on; None for the database alone
    """

    database: Database
    roles: tuple[Chosen, ...]
    teeth: tuple[ToothMessage, ...] = ()
    capture: Captured | None = None
    behaviour: Behaviour | None = None

    @property
    def bound(self) -> dict[str, Match]:
        """Signals by role, of the roles that have one."""
        return {each.role: each.best for each in self.roles if each.best is not None}

    def carriers(self) -> list[Message]:
        """Messages that hold a role, in the order of the database."""
        names = {found.message.name for found in self.bound.values()}
        names |= {name for each in self.teeth for name in (each.teeth, each.anchor)}
        return [message for message in self.database.messages if message.name in names]

    def traffic(self, message: str) -> Traffic | None:
        """Traffic of a message in the capture; None where it did not occur."""
        return self.capture.traffic.get(message) if self.capture else None


def propose(database: Database, capture: Captured | None = None) -> Proposal:
    """Proposal for every role, by names and units, and by the behaviour in a capture."""
    behaviour = Behaviour(capture) if capture else None
    ranked = {role: list(_ranked(database, role, behaviour)) for role in NEEDED}
    teeth = tuple(tooth_messages(database))
    reserved = {name for each in teeth for name in (each.teeth, each.anchor)}
    taken = _without_single_sides(_assigned(ranked, reserved))
    roles = tuple(_chosen(role, ranked[role], taken.get(role)) for role in NEEDED)
    return Proposal(database, roles, teeth, capture, behaviour)


def _ranked(database: Database, role: str, behaviour: Behaviour | None) -> Iterator[Match]:
    """Signals for a role, the best first, their scores corrected by the evidence of the capture."""
    by_name = matches(database, role)
    if behaviour is None or role in SENT:
        yield from by_name[:LOOKED_AT]
        return
    traffic = behaviour.capture.traffic
    here = [each for each in by_name if each.message.name in traffic][:LOOKED_AT]
    absent = [each for each in by_name if each.message.name not in traffic][:RUNNERS_UP]
    looked = [*here, *absent]
    weighed = [_weighed(each, role, behaviour) for each in looked]
    yield from sorted([*weighed, *behaviour.unnamed(role)], key=lambda each: -each.score)


def _weighed(found: Match, role: str, behaviour: Behaviour) -> Match:
    evidence = behaviour.evidence(found, role)
    score = found.score + sum(each.change for each in evidence)
    reasons = (*found.reasons, *(each.reason for each in evidence))
    return replace(found, score=round(min(1.0, max(0.0, score)), 3), reasons=reasons)


def _assigned(ranked: dict[str, list[Match]], reserved: set[str]) -> dict[str, Match]:
    """One signal for each role, no signal for two roles of the bench: the highest scores first."""
    pairs = [(found.score, role, found) for role, all_ in ranked.items() for found in all_]
    order = {role: place for place, role in enumerate(ranked)}
    pairs.sort(key=lambda pair: (-pair[0], order[pair[1]]))
    chosen: dict[str, Match] = {}
    used: set[tuple[bool, str]] = set()
    senders: dict[str, bool] = {}
    for score, role, found in pairs:
        key = role in FIELDS, found.name
        message = found.message.name
        if score < LEAST or role in chosen or key in used or message in reserved:
            continue
        if senders.get(message, role in SENT) != (role in SENT):
            continue  # a request and a status never share a message
        chosen[role] = found
        used.add(key)
        senders[message] = role in SENT
    return chosen


def _without_single_sides(chosen: dict[str, Match]) -> dict[str, Match]:
    """Without a left or right wheel that has no other side: the vehicle has one wheel on that axle."""
    return {
        role: found
        for role, found in chosen.items()
        if _other_side(role) == role or _other_side(role) in chosen
    }


def _other_side(role: str) -> str:
    """Role of the wheel on the other side; the role itself where it has no side."""
    if "_left_" in role:
        return role.replace("_left_", "_right_")
    return role.replace("_right_", "_left_")


def _chosen(role: str, ranked: list[Match], best: Match | None) -> Chosen:
    others = [each for each in ranked if best is None or each.name != best.name]
    return Chosen(role, best, tuple(others[:RUNNERS_UP]))
