"""Devices that fail: the virtual motorcycle, with one of its devices telling something else.

The motorcycle itself, and what it does, stay as they are: only what is told of it changes, between
a pickup and its encoder (teeth) or between a device and its controller (messages). Frames are laid
out and protected anew, with the counter that they had.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from slipbench.bench.vehicle.virtual_motorcycle import VirtualMotorcycle
from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.messages import Authority

AT = 0.6  # s into the trial: in the midst of the excitation


# What is sent for a message: none, one or several, each with its counter.
Sent = tuple[tuple[Any, int], ...]


class Failing(Protocol):
    """What is sent for a message that a device has to tell at `now` (s)."""

    def __call__(self, name: str, told: Any, counter: int, now: float) -> Sent:
        """Tell it."""


def sound(_name: str, told: Any, counter: int, _now: float) -> Sent:
    """Tell it as it is."""
    return ((told, counter),)


def second_vehicle(_name: str, told: Any, counter: int, now: float) -> Sent:
    """A vehicle of the same kind, in the same state, is switched on: it counts for itself."""
    both = (told, counter), (told, (counter + 7) % e2e.PERIOD)
    return both if now >= AT else both[:1]


@dataclass(frozen=True)
class Silent:
    """Nothing is sent by the devices of these messages, or by any device."""

    names: frozenset[str] = frozenset()

    def __call__(self, name: str, told: Any, counter: int, now: float) -> Sent:
        return () if now >= AT and name in (self.names or {name}) else ((told, counter),)


@dataclass
class Standing:
    """Fields, or with none named the counter, stand while everything else goes on."""

    name: str
    fields: tuple[str, ...] = ()
    _first: dict[str, Any] = field(default_factory=dict)
    _counter: int | None = None

    def __call__(self, name: str, told: Any, counter: int, now: float) -> Sent:
        if name != self.name or now < AT:
            return ((told, counter),)
        if not self.fields:
            self._counter = counter if self._counter is None else self._counter
            return ((told, self._counter),)
        self._first = self._first or {each: getattr(told, each) for each in self.fields}
        return ((replace(told, **self._first), counter),)


@dataclass(frozen=True)
class Tells:
    """A field takes a value of its own, which may depend on what it should be."""

    name: str
    field: str
    value: Callable[[Any], Any]

    def __call__(self, name: str, told: Any, counter: int, now: float) -> Sent:
        if name != self.name or now < AT:
            return ((told, counter),)
        return ((replace(told, **{self.field: self.value(getattr(told, self.field))}), counter),)


class Teeth(Protocol):
    """What becomes of the times (s) at which teeth pass. began: s, when the first was untrue."""

    began: float

    def __call__(self, times: list[float]) -> list[float]:
        """Tell when they pass."""


@dataclass
class OneToothOfATurn:
    """A tooth is missing, or a burr between two of them counts as a tooth."""

    teeth: int
    missing: bool
    began: float = math.inf
    _count: int = 0
    _last: float = 0.0

    def __call__(self, times: list[float]) -> list[float]:
        told = []
        for time in times:
            self._count += 1
            if time < AT or self._count % self.teeth:
                told.append(time)
            else:
                wrong = [] if self.missing else [(self._last + time) / 2, time]
                self.began = min(self.began, *wrong, time)
                told += wrong
            self._last = time
        return told


@dataclass
class Slowing:
    """The wheel itself turns slower: by `rate` (1/s) of its speed, until it stands."""

    rate: float
    began: float = AT
    _passed: float = 0.0  # of a tooth that has not passed as a whole
    _last: float = 0.0

    def __call__(self, times: list[float]) -> list[float]:
        told = []
        for time in times:
            pace = max(0.0, 1.0 - self.rate * max(0.0, time - AT))
            before, self._passed = self._passed, self._passed + pace
            if self._passed >= 1.0:
                told.append(self._last + (1.0 - before) / pace * (time - self._last))
                self._passed -= 1.0
            self._last = time
        return told


@dataclass
class Witness:
    """What happened inside the motorcycle: every millisecond's authority, and what the servo did.

    now       s into the trial
    held      s, last moment at which the bench held anything
    off_hand  furthest that the servo was told to be from the rider's hand since the fault, 0..1
    """

    now: float = 0.0
    held: float = 0.0
    off_hand: float = 0.0


class FailingMotorcycle(VirtualMotorcycle):
    """The virtual motorcycle, some of its devices failing: no physics of their failure."""

    witness: Witness
    failing: Failing = staticmethod(sound)

    @classmethod
    def with_faults(
        cls, witness: Witness, failing: Failing, teeth: dict[str, Teeth], *parts: Any
    ) -> "FailingMotorcycle":
        motorcycle = cls(*parts)
        motorcycle.witness, motorcycle.failing = witness, failing
        passing = motorcycle._instruments.teeth

        def told(wheel: str, times: list[float], per_turn: int) -> None:
            passing(wheel, teeth[wheel](times) if wheel in teeth else times, per_turn)

        motorcycle._instruments.teeth = told  # type: ignore[method-assign]
        return motorcycle

    def _live(self, now: float) -> None:
        self.witness.now = now
        super()._live(now)
        grant = self._grant
        if grant.authority != Authority.NONE:
            self.witness.held = now
        if now >= AT and grant.authority & Authority.THROTTLE:
            off = abs(grant.command.throttle - self._rider.grip)
            self.witness.off_hand = max(self.witness.off_hand, off)

    def _send(self, identifier: int, data: bytes) -> None:
        name, told = self._codec.name(identifier), self._codec.decode(identifier, data)
        counter = self._codec.counter(identifier, data)
        assert name is not None
        for answer in self.failing(name, told, counter or 0, self._lived * 1e-3):
            if answer == (told, counter or 0):
                super()._send(identifier, data)
            else:
                super()._send(*self._codec.encode(answer[0], counter=answer[1], name=name))
