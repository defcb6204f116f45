"""Receiving side of the gateway: frames of the user's bus become messages of the bench.

It checks length, checksum, counter and sender of every frame, and joins messages whose fields come in
several frames. What the bus lacks it replaces as the binding states (see Degraded).
"""

import math
from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import replace

from slipbench.bench.gateway.fail_safe import RELEASED
from slipbench.bench.gateway.sender_monitor import SenderMonitor, cycles_of
from slipbench.bench.gateway.wheel_speed import WheelSpeedTeeth
from slipbench.bench.safety.vehicle_monitor import SAFETY, Wheels
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.codec.assembly import Assembly
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    BenchMessage,
    EcuStatus,
    EngineStatus,
    Intervals,
    OpticalSpeed,
    ThrottleStatus,
    ToothIntervals,
    WheelSpeed,
)
from slipbench.protocol.codec.wire import FramePlan
from slipbench.protocol.recording.message_rules import Degraded

MOST_REQUESTS = 1000  # of the last requests, kept while their echo is assumed
ROUNDING = 1e-4  # s, of differences of times of day
NO_STATUS = EcuStatus(Authority.NONE, math.nan, math.nan, math.nan)
WHEELS = {"RearWheelSpeed": "RearTeeth", "FrontWheelSpeed": "FrontTeeth"}


Received = tuple[str, BenchMessage | FrameFault, float]
"""One message of the bench, or the fault of the frame that should hold it; its time in s."""


class Receiver:
    """Received messages of the buses of a binding."""

    def __init__(
        self, binding: Binding, codec: Codec, wheels: Wheels, stale: float, gear: int
    ) -> None:
        """Begin without any frame.

        stale  s, limit of the trial on the age of a status
        gear   of the operating point, where no signal gives it
        """
        self._codec, self._stale, self._degraded = codec, stale, binding.degraded
        self._gear = gear if "gear" in binding.degraded.unmonitored else None
        self._shift = {name: max(0.0, stale - at) for name, at in binding.timeouts.items()}
        self._senders = SenderMonitor(
            cycles_of(plan.message for plan in codec.plans.values()),
            ours=binding.sent,
            periods={
                carrier: plan.guard.period
                for carrier, plan in codec.plans.items()
                if plan.guard and plan.guard.period
            },
        )
        self._counters: dict[str, int | None] = {
            carrier: None
            for carrier, plan in codec.plans.items()
            if any(_feeds(part.name) in SAFETY for part in plan.parts)
        }
        self._assembly = Assembly(codec)
        self._replaces = binding.degraded != Degraded() or any(map(codec.has, WHEELS))
        self._pitch = {
            "RearTeeth": 2 * math.pi * wheels.rear_radius / wheels.teeth,
            "FrontTeeth": 2 * math.pi * wheels.front_radius / wheels.teeth,
        }
        self._encoders = {name: WheelSpeedTeeth(self._pitch[to]) for name, to in WHEELS.items()}
        self._requests: deque[tuple[float, ActuatorCommand]] = deque(maxlen=MOST_REQUESTS)
        self._applied = RELEASED
        self._authority = Authority.NONE  # that the ECU grants, or is taken to grant
        self._authority_assumed = binding.degraded.hand_back is not None
        self._position = math.nan

    @property
    def trouble(self) -> str:
        """Why two senders are on the bus; "" where there is no sign of it."""
        return self._senders.trouble

    def forget(self) -> None:
        """Restart the counts of frames: those received came late, and many at once."""
        self._senders.forget()

    def receive(
        self, key: tuple[int, bool], data: bytes, now: float, since: float, bus: int = 0
    ) -> Sequence[Received]:
        """Messages of a frame that arrived at `now` (s), and not before `since` (s).

        key  its identifier, and whether that is a 29-bit one
        bus  number of its bus
        """
        identifier, extended = key
        plan = self._codec.plan(identifier, extended, bus)
        if plan is None:
            return ()
        payload = plan.check(data)
        if isinstance(payload, FrameFault):
            return _faulty(plan, payload, since)
        carrier = plan.message.name
        counter = None if plan.guard is None else plan.guard.counter(payload)
        self._senders.heard(carrier, now, counter)
        if counter is not None and self._repeated(carrier, counter):
            # its values make no other message new
            return _faulty(plan, FrameFault(Fault.REPEATED, carrier), since)
        if self._shift:
            since -= self._shift.get(carrier, 0.0)
        found = self._assembly.take(plan, payload, since)
        if isinstance(found, FrameFault):
            return _faulty(plan, found, since)
        if not self._replaces:
            return found
        return [each for joined in found for each in self._completed(*joined, now)]

    def _repeated(self, carrier: str, counter: int) -> bool:
        """Whether the counter did not move; lost frames before this one are no fault of it.

        A repeated counter is a fault after a pause as well, although it may have wrapped once.
        """
        if carrier not in self._counters:
            return False
        last, self._counters[carrier] = self._counters[carrier], counter
        return counter == last

    def requested(self, command: ActuatorCommand, now: float) -> None:
        """Store the request that was sent at `now` (s), where its echo is assumed."""
        if self._replaces:
            self._requests.append((now, command))

    def assumed(self, now: float) -> Sequence[Received]:
        """Status of the ECU at `now` (s), where none comes on this bus."""
        if not self._replaces:
            return ()
        self._apply_requests(now)
        if self._codec.has("EcuStatus"):
            return ()
        return [("EcuStatus", self._replaced(NO_STATUS), now)]

    def _apply_requests(self, now: float) -> None:
        """A request counts as applied after the stated latency."""
        latency = (self._degraded.echo or 0.0) - ROUNDING
        while self._requests and now - self._requests[0][0] >= latency:
            _, self._applied = self._requests.popleft()

    def _completed(
        self, name: str, message: BenchMessage, time: float, now: float
    ) -> Iterator[Received]:
        """The message, with what the binding replaces, and what follows from it."""
        match message:
            case WheelSpeed(speed):
                yield WHEELS[name], self._encoders[name].take(speed, now), time
                yield from self._front_wheel_speed(WHEELS[name], speed, time)
            case ToothIntervals():
                yield name, message, time
                if message.layout != Intervals.STANDING:
                    speed = self._pitch[name] * len(message.intervals) / sum(message.intervals)
                    yield from self._front_wheel_speed(name, speed, time)
            case _:
                yield name, self._replaced(message), time

    def _replaced(self, message: BenchMessage) -> BenchMessage:
        """The message, with what no signal gives: authority, echo, gear."""
        match message:
            case EcuStatus():
                return self._ecu_status(message)
            case ThrottleStatus():
                self._position = message.position
                if self._degraded.throttle_body is not None:
                    return replace(message, authority=self._authority)
            case EngineStatus() if self._gear is not None:
                return replace(message, gear=self._gear)
        return message

    def _ecu_status(self, message: EcuStatus) -> EcuStatus:
        applied = self._applied
        if self._authority_assumed:
            message = replace(message, authority=applied.authority)
        if self._degraded.echo is not None:
            ours = bool(message.authority & Authority.THROTTLE)
            throttle = applied.throttle if ours else self._position
            message = replace(message, throttle_command=throttle, spark_command=applied.spark)
        self._authority = message.authority
        return message

    def _front_wheel_speed(self, name: str, speed: float, time: float) -> Iterator[Received]:
        """Speed of the front wheel in place of the optical one."""
        if name == "FrontTeeth" and self._degraded.speed == "front_wheel":
            yield "OpticalSpeed", OpticalSpeed(speed, True, math.nan), time


def _faulty(plan: FramePlan, fault: FrameFault, time: float) -> list[Received]:
    """The fault of a frame, for every message that it should hold."""
    return [(_feeds(part.name), fault, time) for part in plan.parts]


def _feeds(name: str) -> str:
    """Message of the bench that a message leads to."""
    return WHEELS.get(name, name)
