"""Faults of devices: the virtual motorcycle with faulty messages or faulty teeth.

The motion of the motorcycle is not changed. Faults are injected between a pickup and its encoder
(teeth) or between a device and its CAN controller (messages). A changed message is encoded again,
with its own counter and a valid CRC.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from slipbench.bench.vehicle.virtual_motorcycle import VirtualMotorcycle
from slipbench.protocol.codec import e2e
from slipbench.protocol.codec.codec import Frame
from slipbench.protocol.codec.messages import Authority

AT = 0.6  # s, time of the fault in the trial: during the excitation


# What is sent instead of a message: any number of messages, each with its counter.
Sent = tuple[tuple[Any, int], ...]


class Failing(Protocol):
    """What is sent instead of a message of a device at `now` (s)."""

    def __call__(self, name: str, message: Any, counter: int, now: float) -> Sent:
        """Messages to send, each with its counter."""


def no_fault(_name: str, message: Any, counter: int, _now: float) -> Sent:
    """The message, unchanged."""
    return ((message, counter),)


def second_vehicle(_name: str, message: Any, counter: int, now: float) -> Sent:
    """A second vehicle of the same kind, in the same state, with counters of its own."""
    both = (message, counter), (message, (counter + 7) % e2e.PERIOD)
    return both if now >= AT else both[:1]


@dataclass(frozen=True)
class Silent:
    """Messages with these names are not sent; without names, no message is sent."""

    names: frozenset[str] = frozenset()

    def __call__(self, name: str, message: Any, counter: int, now: float) -> Sent:
        return () if now >= AT and name in (self.names or {name}) else ((message, counter),)


@dataclass
class FieldsFrozen:
    """These fields keep their values, or without fields the counter; all else advances."""

    name: str
    fields: tuple[str, ...] = ()
    _first: dict[str, Any] = field(default_factory=dict)
    _counter: int | None = None

    def __call__(self, name: str, message: Any, counter: int, now: float) -> Sent:
        if name != self.name or now < AT:
            return ((message, counter),)
        if not self.fields:
            self._counter = counter if self._counter is None else self._counter
            return ((message, self._counter),)
        self._first = self._first or {each: getattr(message, each) for each in self.fields}
        return ((replace(message, **self._first), counter),)


@dataclass(frozen=True)
class FieldReplaced:
    """One field is replaced by `value(true value)`."""

    name: str
    field: str
    value: Callable[[Any], Any]

    def __call__(self, name: str, message: Any, counter: int, now: float) -> Sent:
        if name != self.name or now < AT:
            return ((message, counter),)
        return (
            (replace(message, **{self.field: self.value(getattr(message, self.field))}), counter),
        )


class Teeth(Protocol):
    """A fault of an encoder's teeth. began: s, time of the first wrong tooth."""

    began: float

    def __call__(self, times: list[float]) -> list[float]:
        """Times (s) at which the encoder counts teeth, from the true times."""


@dataclass
class OneToothOfATurn:
    """One tooth of each turn is missing, or a burr between two teeth counts as a tooth."""

    teeth: int
    missing: bool
    began: float = math.inf
    _count: int = 0
    _last: float = 0.0

    def __call__(self, times: list[float]) -> list[float]:
        passed = []
        for time in times:
            self._count += 1
            if time < AT or self._count % self.teeth:
                passed.append(time)
            else:
                wrong = [] if self.missing else [(self._last + time) / 2, time]
                self.began = min(self.began, *wrong, time)
                passed += wrong
            self._last = time
        return passed


@dataclass
class Slowing:
    """The wheel slows down by `rate` (1/s) of its speed, until it stands still."""

    rate: float
    began: float = AT
    _passed: float = 0.0  # of a tooth that has not passed as a whole
    _last: float = 0.0

    def __call__(self, times: list[float]) -> list[float]:
        passed = []
        for time in times:
            pace = max(0.0, 1.0 - self.rate * max(0.0, time - AT))
            before, self._passed = self._passed, self._passed + pace
            if self._passed >= 1.0:
                passed.append(self._last + (1.0 - before) / pace * (time - self._last))
                self._passed -= 1.0
            self._last = time
        return passed


@dataclass
class GroundTruth:
    """True state of the simulated motorcycle, every millisecond.

    now        s in the trial
    held       s, last time at which the bench had authority
    deviation  largest distance of the commanded throttle from the rider's grip since the fault, 0..1
    """

    now: float = 0.0
    held: float = 0.0
    deviation: float = 0.0


class FailingMotorcycle(VirtualMotorcycle):
    """The virtual motorcycle with faults of its devices; the cause of a fault is not modelled."""

    truth: GroundTruth
    failing: Failing = staticmethod(no_fault)

    @classmethod
    def with_faults(
        cls, truth: GroundTruth, failing: Failing, teeth: dict[str, Teeth], *parts: Any
    ) -> "FailingMotorcycle":
        motorcycle = cls(*parts)
        motorcycle.truth, motorcycle.failing = truth, failing
        passing = motorcycle._instruments.teeth

        def with_teeth_faults(wheel: str, times: list[float], per_turn: int) -> None:
            passing(wheel, teeth[wheel](times) if wheel in teeth else times, per_turn)

        motorcycle._instruments.teeth = with_teeth_faults  # type: ignore[method-assign]
        return motorcycle

    def _advance(self, now: float) -> None:
        self.truth.now = now
        super()._advance(now)
        grant = self._grant
        if grant.authority != Authority.NONE:
            self.truth.held = now
        if now >= AT and grant.authority & Authority.THROTTLE:
            off = abs(grant.command.throttle - self._rider.grip)
            self.truth.deviation = max(self.truth.deviation, off)

    def _send(self, frame: Frame) -> None:
        identifier, data, *_ = frame
        name, message = self._codec.name(identifier), self._codec.decode(identifier, data)
        counter = self._codec.counter(identifier, data)
        assert name is not None
        for sent in self.failing(name, message, counter or 0, self._elapsed * 1e-3):
            if sent == (message, counter or 0):
                super()._send(frame)
            else:
                super()._send(Frame(*self._codec.encode(sent[0], counter=sent[1], name=name)))
