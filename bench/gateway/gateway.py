"""The gateway: each tick reads frames, advances the trial, calls `permit` and sends."""

import math
from collections.abc import Sequence, Set
from dataclasses import dataclass, replace

import can

from slipbench.bench.bus.opening import as_sequence
from slipbench.bench.gateway.fail_safe import RELEASED, FailSafe, described
from slipbench.bench.gateway.gateway_bus import GatewayBus
from slipbench.bench.gateway.receiver import Receiver
from slipbench.bench.gateway.slip_control import slip_control
from slipbench.bench.gateway.stamps import Stamp, as_stamped
from slipbench.bench.gateway.tx_echo import Key
from slipbench.bench.loop.clock import SECOND
from slipbench.bench.loop.loop import LAST_TICK, MOST_TICKS
from slipbench.bench.loop.ring import BIT_RATE_SWITCH, ERROR, EXTENDED, FD, REMOTE, SENT, Ring
from slipbench.bench.safety.permit import Held, Trip, permit
from slipbench.bench.safety.trial import (
    ENDED,
    HOLDING,
    NO_OFFSETS,
    Plan,
    TrialState,
    advance,
    controller_active,
    requested_command,
    tripped,
    waveform_value,
)
from slipbench.bench.safety.vehicle_monitor import VehicleMonitor, Wheels
from slipbench.bench.safety.vehicle_state import VehicleState
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.codec.codec import Codec, Frame, Sender, key_of
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    Phase,
    TrialStatus,
    TripReason,
)

STATUS_PERIOD = 0.020  # s, of TrialStatus
MOST_NOTES = 100
# Frames received from a bus in a tick: more than a bus at 1 Mbit/s carries (425 of no byte) in the 20 ms
# after which the devices take authority back. The remainder waits, and the present state is unknown.
MOST_FRAMES = 500
BEHIND = f"more than {MOST_FRAMES} frames waited at one tick"
UNRECORDED = "the recorder cannot write"
TOO_LONG = f"the loop counts no more than {MOST_TICKS} ticks"
AFTERWARDS = 0.2  # s for which the gateway stays on the bus after the end, released


@dataclass(frozen=True)
class PhaseChange:
    """When the trial entered a phase; ns on the recording's clock."""

    phase: Phase
    time_ns: int


class Gateway:
    """State of the trial between ticks; the decisions are pure functions of other modules."""

    def __init__(
        self,
        plan: Plan,
        bus: can.BusABC | Sequence[can.BusABC],
        binding: Binding,
        ring: Ring,
        wheels: Wheels,
        stamps: Sequence[Stamp] = (),
    ) -> None:
        """Use `binding` on `bus` and put every received frame into `ring`.

        bus     one, or as many as the binding names (`Binding.buses`), in that order; each must
                receive its own frames: the record gives the time of each command on the wire
        stamps  of each bus: turns its time stamps into the recording's time; none: as they are
        """
        codec = binding.codec()
        self._plan, self._codec, self._ring = plan, codec, ring
        self._sender = Sender(codec)
        self._buses = _buses(bus, codec, binding.sent, stamps)
        self._reports = codec.has("TrialStatus")
        self._releases_by_silence = not codec.requests_authority
        self._monitor = VehicleMonitor(wheels)
        self._control = slip_control(plan, wheels, codec)
        limits, point = plan.trial.limits, plan.trial.operating_point
        self._receiver = Receiver(binding, codec, wheels, limits.stale, point.gear)
        self._last = RELEASED
        self._requested_since = 0.0
        self._full = self._behind = False
        self._listened = -math.inf
        self._status_due = 0.0
        self._ended_at: float | None = None
        self._unrecorded: tuple[GatewayBus, can.Message] | None = None
        self._fail_safe = FailSafe(codec, silent=not codec.requests_authority)
        self.state = TrialState()
        self.changes: list[PhaseChange] = []
        self.refusals: list[str] = []
        self.refused = False  # whether the bus refused the last command

    def tick(self, number: int, due: int) -> bool:
        """Run one tick, due at `due` (ns); False once the trial has ended and its status was sent.

        An exception in it ends the trial in the same tick: authority is released, the reason is
        kept, and the frames on the bus are recorded until the end.
        """
        if not self._fail_safe.active:
            try:
                return self._tick(number, due)
            except Exception as fault:  # any exception: the rider gets the throttle at once
                self.fail(fault, due, f"in tick {number}")
        return self._fail_safe_tick(number, due)

    def fail(self, fault: Exception, due: int, where: str) -> None:
        """End the trial because of an exception at `due` (ns); nothing in it depends on others."""
        self._fail_safe.active = True
        for bus in self._buses:
            bus.records_sent = bus.echo.silent
        text = f"internal error {where}: {described(fault)}"
        self.refusals.insert(0, text)
        if self.state.phase not in ENDED:
            trip = Trip(TripReason.INTERNAL_ERROR, text)
            self.state = replace(self.state, phase=Phase.TRIPPED, since=due / SECOND, trip=trip)
            self.changes.append(PhaseChange(Phase.TRIPPED, due))
        if self._ended_at is None:
            self._ended_at = due / SECOND

    def _fail_safe_tick(self, number: int, due: int) -> bool:
        """Send a release and a status, and record; each step whatever became of the others."""
        now, attempt = due / SECOND, self._fail_safe.attempt
        release = self._fail_safe.release(self._sender, now)
        sent = [attempt(self._put_now, frame, due) for frame in release]
        self.refused = not all(sent)
        if now >= self._status_due and self._reports:
            self._status_due = now + STATUS_PERIOD - 1e-6
            trip = self.state.trip.reason if self.state.trip else TripReason.NONE
            status = TrialStatus(self.state.phase, Authority.NONE, trip, number)
            for frame in self._fail_safe.status(self._sender, status):
                attempt(self._put_now, frame, due)
        for bus in self._buses:
            attempt(self._record_waiting, bus, due)
        return self._ended_at is None or now - self._ended_at < AFTERWARDS

    def _put_now(self, frame: Frame, due: int) -> bool:
        bus, message = self._buses[frame.bus], _message(frame)
        bus.port.send(message)
        if bus.records_sent:
            self._record(bus, message, due, own=True)
        return True

    def _record_waiting(self, bus: GatewayBus, due: int) -> None:
        """Record what has arrived on a bus, the frame at which the exception came included."""
        waiting = None
        if self._unrecorded is not None and self._unrecorded[0] is bus:
            (_, waiting), self._unrecorded = self._unrecorded, None
        for _ in range(MOST_FRAMES):
            if waiting is not None:
                own = _key(waiting) in bus.ours
                time_ns = self._fail_safe.attempt(bus.stamp, waiting.timestamp, default=due)
                self._record(bus, waiting, time_ns, own)
            waiting = bus.port.recv(0)
            if waiting is None:
                return

    def _tick(self, number: int, due: int) -> bool:
        now = due / SECOND
        behind = not self._listen(now) or self._behind
        self._behind = False
        recording = not (self._full or self._ring.failed)
        for name, status, time in self._receiver.assumed(now):
            self._monitor.observe(name, status, time)
        vehicle = self._monitor.state(now, bus_off=self._bus_off(), recording=recording)
        if behind:  # the frames are old: they neither arm nor keep authority
            vehicle = VehicleState()
            self._receiver.forget()
            if self.state.phase in HOLDING:
                self._trip(TripReason.TIMING, BEHIND, due)
        if self._receiver.trouble:
            self._trip(TripReason.TWO_SENDERS, self._receiver.trouble, due)
        if number >= LAST_TICK:
            self.stop(due, TOO_LONG)
        if not recording and self.state.phase not in HOLDING:  # with authority, `permit` says so
            self._trip(TripReason.RECORDER, UNRECORDED, due)
        last_offsets = self._control.requested if self._control else NO_OFFSETS
        self._move_to(advance(self.state, vehicle, self._plan, now, last_offsets), due)
        self._send(self._decide(vehicle, now, due), now)
        self._report(number, now)
        return self._ended_at is None or now - self._ended_at < AFTERWARDS

    @property
    def expects_the_button(self) -> bool:
        """Whether the trial would begin if the rider pressed the button now."""
        if self._fail_safe.active:
            return False
        armed = self.state.phase == Phase.ARMED and self.state.released
        return armed and not self._behind and not any(bus.refused for bus in self._buses)

    def attend(self, due: int) -> bool:
        """Receive between two ticks, at `due` (ns); True where the rider has pressed the button."""
        now = due / SECOND
        try:
            self._behind = not self._listen(now)
            return not self._behind and self._monitor.state(now).rider.button
        except Exception as fault:  # as in `tick`, which follows at once
            self.fail(fault, due, "between two ticks")
            return True

    def stop(self, due: int, why: str = "stopped by the operator") -> None:
        """End the trial from outside, as by the operator's interrupt."""
        try:
            self._trip(TripReason.STOPPED, why, due)
        except Exception as fault:
            self.fail(fault, due, "while it was stopped")

    def _trip(self, reason: TripReason, detail: str, due: int) -> None:
        self._move_to(tripped(self.state, Trip(reason, detail), due / SECOND), due)

    def _listen(self, now: float) -> bool:
        """Receive the waiting frames; False where they are too many for one tick.

        They count as old as the last reception before them: a status that waited in the queue is
        not new. Where time went back, they count as received now.
        """
        since, self._listened = min(self._listened, now), now
        in_time = True
        for bus in self._buses:
            in_time = self._listen_to(bus, now, since) and in_time
        return in_time

    def _listen_to(self, bus: GatewayBus, now: float, since: float) -> bool:
        """Receive the waiting frames of a bus; False where they are too many for one tick."""
        receive, ours, stamp = bus.port.recv, bus.ours, bus.stamp
        for _ in range(MOST_FRAMES):
            try:
                message = receive(0)
            except can.CanError as fault:
                self._refused(bus, fault)
                return True
            if message is None:
                return True
            self._unrecorded = bus, message
            data, key = bytes(message.data), _key(message)
            own = key in ours and not message.is_error_frame and bus.echo.heard(key, data)
            self._record(bus, message, stamp(message.timestamp), own)
            self._unrecorded = None
            if message.is_error_frame:
                bus.controller.error_frame(message)
            elif not (own or message.is_remote_frame):
                self._observe(bus, key, data, now, since)
        return False

    def _observe(self, bus: GatewayBus, key: Key, data: bytes, now: float, since: float) -> None:
        for name, content, time in self._receiver.receive(key, data, now, since, bus.number):
            if isinstance(content, FrameFault):
                self._monitor.fault(name)
                continue
            self._monitor.observe(name, content, time)
            if self._control:
                self._control.observe(name, content, now)

    def _bus_off(self) -> bool:
        """Whether one of the buses is off, or was since the last call."""
        off = False
        for bus in self._buses:  # call off() of every bus: the call resets its latch
            off = bus.off() or off
        return off

    def _record(self, bus: GatewayBus, message: can.Message, time_ns: int, own: bool) -> None:
        flags = (
            (EXTENDED if message.is_extended_id else 0)
            | (FD if message.is_fd else 0)
            | (BIT_RATE_SWITCH if message.bitrate_switch else 0)
            | (REMOTE if message.is_remote_frame else 0)
            | (ERROR if message.is_error_frame else 0)
            | (SENT if own else 0)
        )
        data = bytes(message.data)
        if not self._ring.append(time_ns, message.arbitration_id, flags, data, bus.number):
            self._full = True

    def _decide(self, vehicle: VehicleState, now: float, due: int) -> ActuatorCommand:
        """Command for this tick; a trip makes it a release in the same tick."""
        requested = None
        if self._control and controller_active(self.state, self._plan):
            requested = self._control.update(waveform_value(self.state, self._plan, now), now)
        command = requested_command(self.state, self._plan, now, requested)
        if command.authority == Authority.NONE:
            return command
        if self._last.authority == Authority.NONE:
            self._requested_since = now
        held = Held(
            self.state.throttle,
            self.state.grip,
            self._plan.trial.operating_point.gear,
            self._last,
            self._requested_since,
        )
        decision = permit(
            command, held, vehicle, self._plan.trial.limits, self._plan.trial.command.silence
        )
        if isinstance(decision, ActuatorCommand):
            return decision
        self._move_to(tripped(self.state, decision, now), due)
        return replace(RELEASED, time=now)

    def _move_to(self, state: TrialState, due: int) -> None:
        if state.phase != self.state.phase:
            self.changes.append(PhaseChange(state.phase, due))
            if state.phase == Phase.EXCITING:
                self._monitor.start_distance(due / SECOND)
            if state.phase in ENDED:
                self._ended_at = due / SECOND
        self.state = state

    def _send(self, command: ActuatorCommand, now: float) -> None:
        """Send a command; if the bus refuses it, the last one still holds."""
        if self._releases_by_silence and command.authority == Authority.NONE:
            self.refused = False
        else:
            sent = [self._put(frame, now) for frame in self._sender.frames(command)]
            self.refused = not all(sent)
        if not self.refused:
            self._last = command
            self._receiver.requested(command, now)

    def _report(self, number: int, now: float) -> None:
        if now < self._status_due or not self._reports:
            return
        self._status_due = now + STATUS_PERIOD - 1e-6
        trip = self.state.trip.reason if self.state.trip else TripReason.NONE
        holding = self.state.phase in HOLDING
        authority = self._plan.authority if holding else Authority.NONE
        status = TrialStatus(self.state.phase, authority, trip, number)
        for frame in self._sender.frames(status):
            self._put(frame, now)

    def _put(self, frame: Frame, now: float) -> bool:
        """Send a frame on its bus; one that refuses several counts as off until it accepts one."""
        bus, message = self._buses[frame.bus], _message(frame)
        try:
            bus.port.send(message)
        except can.CanError as fault:
            self._refused(bus, fault)
            return False
        bus.refused = 0
        bus.echo.sent(_key(message), frame.data)
        if bus.echo.silent:  # never echoed: the record gives the time of sending
            self._record(bus, message, round(now * SECOND), own=True)
        return True

    def _refused(self, bus: GatewayBus, fault: can.CanError) -> None:
        bus.refused += 1
        if len(self.refusals) < MOST_NOTES:
            self.refusals.append(str(fault))


def _buses(
    ports: can.BusABC | Sequence[can.BusABC], codec: Codec, sent: Set[str], stamps: Sequence[Stamp]
) -> tuple[GatewayBus, ...]:
    """Buses of the codec, by number; sent: messages of the database that only the bench sends."""
    ours: list[set[Key]] = [set() for _ in codec.buses]
    for carrier in sent:
        message = codec.plan_of(carrier).message
        ours[codec.buses.index(message.bus)].add(key_of(message))
    stamps = stamps or [as_stamped] * len(ours)
    each = zip(as_sequence(ports), ours, stamps, strict=True)
    return tuple(GatewayBus(number, *of_bus) for number, of_bus in enumerate(each))


def _key(message: can.Message) -> Key:
    return message.arbitration_id, message.is_extended_id


def _message(frame: Frame) -> can.Message:
    identifier, data, extended, _bus = frame
    return can.Message(
        arbitration_id=identifier, data=data, is_extended_id=extended, is_fd=len(data) > 8
    )
