"""Fault injection on a bus: a fault plan gives the same faults whenever it is applied.

A plan is data. Whether a fault acts on a frame is a function of the seed of the plan, the position of
the fault in the plan, the number of the frame on the wire and its receiver. It depends on no state and
on no other random draw.

    FaultPlan(seed=7, faults=(
        Lost(0.01),                                             # 1 % of all frames, always
        Disturbed(1.0, Where(begin=2.0, senders={"gateway"})),  # the gateway goes bus-off at 2 s
        Frozen(Where(begin=3.0, end=3.5, identifiers={0x30})),  # one message is frozen
    ))

`Disturbed` is the fault that CAN itself detects and repeats. All others act after its checks, in the
buffer or driver of a receiver, where no node on the wire can detect them.
"""

from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from math import inf
from typing import NamedTuple

from slipbench.bench.bus.frame import Frame

ALL_IDENTIFIERS: frozenset[int] = frozenset()
ALL_NODES: frozenset[str] = frozenset()
LONGEST = 3600.0  # s, largest delay of a frame


class Passage(NamedTuple):
    """Transmission of a frame to one receiver. time: s since the plan began; number: attempt."""

    frame: Frame
    number: int
    time: float
    sender: str
    receiver: str


class Copy(NamedTuple):
    """Copy of a frame at a receiver. delay: s."""

    data: bytes
    delay: float = 0.0
    overtaken: float = 0.0  # s, longest wait for a later frame that is delivered first


@dataclass(frozen=True, slots=True)
class Where:
    """Frames on which a fault acts. begin, end: s since the plan began; an empty set means all."""

    begin: float = 0.0
    end: float = inf
    identifiers: AbstractSet[int] = ALL_IDENTIFIERS
    senders: AbstractSet[str] = ALL_NODES
    receivers: AbstractSet[str] = ALL_NODES

    def holds(self, passage: Passage) -> bool:
        """Whether the fault may act on this frame at this receiver."""
        return (
            self.begin <= passage.time < self.end
            and (not self.identifiers or passage.frame.identifier in self.identifiers)
            and (not self.senders or passage.sender in self.senders)
            and (not self.receivers or passage.receiver in self.receivers)
        )


EVERYWHERE = Where()


@dataclass(frozen=True, slots=True)
class Disturbed:
    """A bit of the frame is destroyed on the wire: all nodes detect it, the sender repeats it.

    chance  0..1, of each attempt. `where.receivers` has no effect: no node receives the frame.
    """

    chance: float
    where: Where = EVERYWHERE


@dataclass(frozen=True, slots=True)
class Lost:
    """The receiver acknowledges the frame and then loses it, as a full buffer does."""

    chance: float
    where: Where = EVERYWHERE

    def apply(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """No copies."""
        return []


@dataclass(frozen=True, slots=True)
class Corrupted:
    """One bit of the payload is inverted after the CRC check of CAN, as by a faulty memory."""

    chance: float
    where: Where = EVERYWHERE

    def apply(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """Copies with one inverted bit, selected by `draw` (0..1)."""
        return [copy._replace(data=_inverted(copy.data, draw)) for copy in copies]


@dataclass(frozen=True, slots=True)
class Duplicated:
    """The receiver gets the frame twice, as when the last bit of its end was misread."""

    chance: float
    where: Where = EVERYWHERE

    def apply(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """All copies twice."""
        return [*copies, *copies]


@dataclass(frozen=True, slots=True)
class Delayed:
    """The receiver gets the frame late: by `by` s, and up to `spread` s more."""

    chance: float
    by: float
    spread: float = 0.0
    where: Where = EVERYWHERE

    def apply(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """Delayed copies; `draw` (0..1) is the fraction of `spread` that is added."""
        later = self.by + self.spread * draw
        return [copy._replace(delay=copy.delay + later) for copy in copies]


@dataclass(frozen=True, slots=True)
class Reordered:
    """The next frame is delivered before this one, which waits for it for `at_most` s."""

    chance: float
    at_most: float = 0.010
    where: Where = EVERYWHERE

    def apply(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """Copies that wait for the next frame."""
        return [copy._replace(overtaken=self.at_most) for copy in copies]


@dataclass(frozen=True, slots=True)
class Frozen:
    """Frames repeat the payload before the fault: counter, CRC and values are all frozen."""

    where: Where
    chance: float = 1.0

    def apply(self, copies: list[Copy], passage: Passage, draw: float) -> list[Copy]:
        """Copies as they are: `Faults` has put the old payload in before."""
        return copies


Fault = Disturbed | Lost | Corrupted | Duplicated | Delayed | Reordered | Frozen


@dataclass(frozen=True, slots=True)
class FaultPlan:
    """Faults, in the order in which they act on a frame, and the seed of their random draws."""

    faults: tuple[Fault, ...] = ()
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the values. Raises ValueError for a plan that cannot be applied."""
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
    """A fault plan and its state: the last payload of each identifier, for `Frozen`."""

    plan: FaultPlan
    _last: dict[int, bytes] = field(default_factory=dict)

    def __bool__(self) -> bool:
        """Whether the plan has any fault."""
        return bool(self.plan.faults)

    def disturbed(self, passage: Passage) -> float | None:
        """Fraction (0..1) of its length after which an attempt is destroyed, or None."""
        for index, fault in enumerate(self.plan.faults):
            if isinstance(fault, Disturbed) and fault.where.holds(passage):
                draw = _draw(self.plan.seed, index, passage.number, "")
                if draw < fault.chance:
                    return draw / fault.chance
        return None

    def remember(self, passage: Passage) -> None:
        """Store the payload of a frame that was sent, for `Frozen`."""
        for fault in self.plan.faults:
            if isinstance(fault, Frozen):
                identifier = passage.frame.identifier
                frozen = fault.where.begin <= passage.time < fault.where.end
                if not frozen or identifier not in self._last:
                    self._last[identifier] = passage.frame.data

    def copies(self, passage: Passage) -> list[Copy]:
        """Copies of a sent frame at the receiver; none where it is lost."""
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
            copies = fault.apply(copies, passage, draw / fault.chance)
        return copies


def _inverted(data: bytes, draw: float) -> bytes:
    if not data:
        return data
    bit = int(draw * 8 * len(data))
    number = int.from_bytes(data, "little") ^ 1 << bit
    return number.to_bytes(len(data), "little")


def _draw(seed: int, fault: int, number: int, receiver: str) -> float:
    """Random number in [0, 1): hash of the arguments (splitmix64, Steele et al. 2014)."""
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
