"""What goes wrong on a bus, and when: a plan that gives the same faults whenever it is followed.

A plan is data. Whether a fault strikes a frame is a function of the plan's seed, the fault's place
in the plan, the frame's number on the wire and its receiver: no state, and no other draw, moves it.

    FaultPlan(seed=7, faults=(
        Lost(0.01),                                             # 1 % of everything, always
        Disturbed(1.0, Where(begin=2.0, senders={"gateway"})),  # the gateway to bus-off at 2 s
        Frozen(Where(begin=3.0, end=3.5, identifiers={0x30})),  # one message stands still
    ))

What CAN itself detects and repeats is `Disturbed`; all others happen beyond its checks, in a
receiver's buffer or driver, where nobody on the wire is told.
"""

from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

from slipbench.bench.bus.frame import Frame

ALL: frozenset[int] = frozenset()
ANYBODY: frozenset[str] = frozenset()
LONGEST = 3600.0  # s that a frame may be late


class Passage(NamedTuple):
    """A frame on its way to one receiver; `time` in s of the plan, `number` of its attempt."""

    frame: Frame
    number: int
    time: float
    sender: str
    receiver: str


class Copy(NamedTuple):
    """What a receiver gets of a frame: the payload, how much later (s), and whether overtaken."""

    data: bytes
    delay: float = 0.0
    overtaken: float = 0.0  # s that it waits at most for a later frame to pass it


@dataclass(frozen=True, slots=True)
class Where:
    """Which frames, and when: s since the plan began; an empty set means every one."""

    begin: float = 0.0
    end: float = inf
    identifiers: AbstractSet[int] = ALL
    senders: AbstractSet[str] = ANYBODY
    receivers: AbstractSet[str] = ANYBODY

    def holds(self, passage: Passage) -> bool:
        """Tell whether the fault may strike this frame on its way to this receiver."""
        return (
            self.begin <= passage.time < self.end
            and (not self.identifiers or passage.frame.identifier in self.identifiers)
            and (not self.senders or passage.sender in self.senders)
            and (not self.receivers or passage.receiver in self.receivers)
        )


EVERYWHERE = Where()


@dataclass(frozen=True, slots=True)
class Disturbed:
    """A bit of the frame is destroyed on the wire: all nodes see it, and the sender repeats it.

    `chance` per attempt. `where.receivers` has no say: nobody receives a destroyed frame.
    """

    chance: float
    where: Where = EVERYWHERE


@dataclass(frozen=True, slots=True)
class Lost:
    """A receiver acknowledged the frame and then lost it, as a full buffer does."""

    chance: float
    where: Where = EVERYWHERE

    def strike(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """Leave nothing."""
        return []


@dataclass(frozen=True, slots=True)
class Corrupted:
    """One bit of the payload is inverted behind the bus's own CRC, as in a faulty memory."""

    chance: float
    where: Where = EVERYWHERE

    def strike(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """Invert the bit that `draw` names."""
        return [copy._replace(data=_inverted(copy.data, draw)) for copy in copies]


@dataclass(frozen=True, slots=True)
class Duplicated:
    """The receiver gets the frame twice, as when the last bit of its end was misread."""

    chance: float
    where: Where = EVERYWHERE

    def strike(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """Double what there is."""
        return [*copies, *copies]


@dataclass(frozen=True, slots=True)
class Delayed:
    """The receiver gets the frame later: by `by` s, and up to `spread` s more."""

    chance: float
    by: float
    spread: float = 0.0
    where: Where = EVERYWHERE

    def strike(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """Let it come later; `draw` says by how much of the spread."""
        later = self.by + self.spread * draw
        return [copy._replace(delay=copy.delay + later) for copy in copies]


@dataclass(frozen=True, slots=True)
class Reordered:
    """The next frame to this receiver overtakes this one, which waits for it `at_most` s."""

    chance: float
    at_most: float = 0.010
    where: Where = EVERYWHERE

    def strike(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """Hold it back."""
        return [copy._replace(overtaken=self.at_most) for copy in copies]


@dataclass(frozen=True, slots=True)
class Frozen:
    """Frames keep the payload of the last one before: counter, CRC and values all stand still."""

    where: Where
    chance: float = 1.0

    def strike(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """Leave it to the wire, which remembers: `Faults` puts the old payload in first."""
        return copies


Fault = Disturbed | Lost | Corrupted | Duplicated | Delayed | Reordered | Frozen


@dataclass(frozen=True, slots=True)
class FaultPlan:
    """Faults, in the order in which they act on a frame, and the seed of their chances."""

    faults: tuple[Fault, ...] = ()
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse what cannot be followed; raises ValueError."""
        for fault in self.faults:
            if not 0 <= fault.chance <= 1:
                raise ValueError(f"chance = {fault.chance} is not between 0 and 1")
            for name in ("by", "spread", "at_most"):
                seconds = getattr(fault, name, 0.0)
                if not 0 <= seconds <= LONGEST:
                    raise ValueError(f"{name} = {seconds} s is not between 0 and {LONGEST:.0f}")
            where = fault.where
            if not all(isinstance(each, int) for each in where.identifiers):
                raise ValueError("identifiers are numbers")
            if not all(isinstance(each, str) for each in (*where.senders, *where.receivers)):
                raise ValueError("senders and receivers are names")


NO_FAULTS = FaultPlan()


@dataclass
class Faults:
    """A plan at work: the plan, and the last payload of each identifier that it may freeze."""

    plan: FaultPlan
    _last: dict[int, bytes] = field(default_factory=dict)

    def __bool__(self) -> bool:
        """Tell whether anything can go wrong."""
        return bool(self.plan.faults)

    def disturbed(self, passage: Passage) -> float | None:
        """Tell after which part of its length (0..1) an attempt is destroyed, if it is."""
        for index, fault in enumerate(self.plan.faults):
            if isinstance(fault, Disturbed) and fault.where.holds(passage):
                draw = _draw(self.plan.seed, index, passage.number, "")
                if draw < fault.chance:
                    return draw / fault.chance
        return None

    def remember(self, passage: Passage) -> None:
        """Keep the payload of a frame that was carried, for whoever freezes the next."""
        for fault in self.plan.faults:
            if isinstance(fault, Frozen):
                identifier = passage.frame.identifier
                frozen = fault.where.begin <= passage.time < fault.where.end
                if not frozen or identifier not in self._last:
                    self._last[identifier] = passage.frame.data

    def copies(self, passage: Passage) -> list[Copy]:
        """Give what the receiver gets of a frame that the wire carried."""
        copies = [Copy(passage.frame.data)]
        for index, fault in enumerate(self.plan.faults):
            if isinstance(fault, Disturbed) or not fault.where.holds(passage):
                continue
            draw = _draw(self.plan.seed, index, passage.number, passage.receiver)
            if draw >= fault.chance:
                continue
            if isinstance(fault, Frozen):
                old = self._last.get(passage.frame.identifier, passage.frame.data)
                copies = [copy._replace(data=old) for copy in copies]
            copies = fault.strike(copies, passage, draw / fault.chance)
        return copies


def _inverted(data: bytes, draw: float) -> bytes:
    if not data:
        return data
    bit = int(draw * 8 * len(data))
    number = int.from_bytes(data, "little") ^ 1 << bit
    return number.to_bytes(len(data), "little")


def _draw(seed: int, fault: int, number: int, receiver: str) -> float:
    """Draw from [0, 1) by hashing what names the draw (splitmix64, Steele et al. 2014)."""
    name = int.from_bytes(receiver.encode(), "little") % 0xFFFF_FFFB
    state = 0
    for part in (seed, fault, number, name):
        state = _mixed(state ^ part)
    return state / 2**64


def _mixed(state: int) -> int:
    state = (state + 0x9E3779B97F4A7C15) & 0xFFFF_FFFF_FFFF_FFFF
    state = (state ^ state >> 30) * 0xBF58476D1CE4E5B9 & 0xFFFF_FFFF_FFFF_FFFF
    state = (state ^ state >> 27) * 0x94D049BB133111EB & 0xFFFF_FFFF_FFFF_FFFF
    return state ^ state >> 31
