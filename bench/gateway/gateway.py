"""The gateway: each tick reads frames, advances the trial, calls `permit` and sends."""

import math
from dataclasses import dataclass, replace

import can

from slipbench.bench.gateway.controller_state import ControllerState
from slipbench.bench.gateway.fail_safe import RELEASED, FailSafe, described
from slipbench.bench.gateway.sender_monitor import OURS, SenderMonitor
from slipbench.bench.gateway.slip_control import slip_control
from slipbench.bench.gateway.stamps import Stamp, as_stamped
from slipbench.bench.gateway.tx_echo import TxEcho
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
from slipbench.bench.safety.vehicle_monitor import SAFETY, VehicleMonitor, Wheels
from slipbench.bench.safety.vehicle_state import VehicleState
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    Phase,
    TrialStatus,
    TripReason,
)
from slipbench.protocol.database.layout import Database

STATUS_PERIOD = 0.020  # s, of TrialStatus
OFF_THE_BUS = 3  # frames refused in a row; a single one is a queue that is full for a moment
MOST_NOTES = 100
# Frames received in a tick: more than a bus at 1 Mbit/s carries (425 of no byte) in the 20 ms
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
    """State of the trial between ticks; every decision is a pure function elsewhere."""

    def __init__(
        self,
        plan: Plan,
        bus: can.BusABC,
        database: Database,
        ring: Ring,
        wheels: Wheels,
        stamp: Stamp = as_stamped,
    ) -> None:
        """Use `database` on `bus` and put every received frame into `ring`.

        `stamp` turns time stamps of the bus into the recording's time. The bus must receive its own
        frames: the record gives the time of each command on the wire.
        """
        codec = Codec(database)
        self._plan, self._bus, self._codec, self._ring = plan, bus, codec, ring
        self._stamp = stamp
        self._sender = Sender(codec)
        self._own = TxEcho()
        self._controller = ControllerState(bus)
        self._ours = {codec.identifier(name) for name in OURS}
        self._monitor = VehicleMonitor(wheels)
        self._control = slip_control(plan, wheels, database)
        self._senders = SenderMonitor(_cycles(database))
        self._counters: dict[str, int | None] = dict.fromkeys(SAFETY)
        self._last = RELEASED
        self._requested_since = 0.0
        self._refused_in_a_row = 0
        self._full = self._behind = False
        self._listened = -math.inf
        self._status_due = 0.0
        self._ended_at: float | None = None
        self._unrecorded: can.Message | None = None
        self._fail_safe = FailSafe(codec)
        self.state = TrialState()
        self.changes: list[PhaseChange] = []
        self.refusals: list[str] = []
        self.refused = False  # whether the bus refused the last command

    def tick(self, number: int, due: int) -> bool:
        """Run one tick, due at `due` (ns); False once the trial has ended and its status was sent.

        An exception in it ends the trial in the same tick: authority is released, the reason is
        kept, and what comes on the bus is recorded until the end.
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
        self._fail_safe.records_sent = self._own.silent
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
        self.refused = not attempt(self._put_now, self._fail_safe.release(self._sender, now), due)
        if now >= self._status_due:
            self._status_due = now + STATUS_PERIOD - 1e-6
            trip = self.state.trip.reason if self.state.trip else TripReason.NONE
            status = TrialStatus(self.state.phase, Authority.NONE, trip, number)
            attempt(self._put_now, self._fail_safe.status(self._sender, status), due)
        attempt(self._record_waiting, due)
        return self._ended_at is None or now - self._ended_at < AFTERWARDS

    def _put_now(self, frame: tuple[int, bytes], due: int) -> bool:
        identifier, data = frame
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        self._bus.send(message)
        if self._fail_safe.records_sent:
            self._record(message, due, own=True)
        return True

    def _record_waiting(self, due: int) -> None:
        """Record what has arrived, the frame at which the exception came included."""
        waiting, self._unrecorded = self._unrecorded, None
        for _ in range(MOST_FRAMES):
            if waiting is not None:
                own = waiting.arbitration_id in self._ours
                time_ns = self._fail_safe.attempt(self._stamp, waiting.timestamp, default=due)
                self._record(waiting, time_ns, own)
            waiting = self._bus.recv(0)
            if waiting is None:
                return

    def _tick(self, number: int, due: int) -> bool:
        now = due / SECOND
        behind = not self._listen(now) or self._behind
        self._behind = False
        recording = not (self._full or self._ring.failed)
        vehicle = self._monitor.state(
            now,
            bus_off=self._controller.off() or self._refused_in_a_row >= OFF_THE_BUS,
            recording=recording,
        )
        if behind:  # the frames are old: they neither arm nor keep authority
            vehicle = VehicleState()
            self._senders.forget()
            if self.state.phase in HOLDING:
                self._trip(TripReason.TIMING, BEHIND, due)
        if self._senders.trouble:
            self._trip(TripReason.TWO_SENDERS, self._senders.trouble, due)
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
        return armed and not self._behind and not self._refused_in_a_row

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
        for _ in range(MOST_FRAMES):
            try:
                message = self._bus.recv(0)
            except can.CanError as fault:
                self._refused(fault)
                return True
            if message is None:
                return True
            self._unrecorded = message
            identifier, data = message.arbitration_id, bytes(message.data)
            own = (
                not message.is_error_frame
                and identifier in self._ours
                and self._own.heard(identifier, data)
            )
            self._record(message, self._stamp(message.timestamp), own)
            self._unrecorded = None
            if message.is_error_frame:
                self._controller.error_frame(message)
            elif not (own or _carries_nothing(message)):
                self._observe(identifier, data, now, since)
        return False

    def _observe(self, identifier: int, data: bytes, now: float, since: float) -> None:
        decoded = self._codec.decode(identifier, data)
        if isinstance(decoded, FrameFault):
            self._monitor.fault(decoded.message)
            return
        name = self._codec.name(identifier)
        if name is None:
            return
        self._senders.heard(name, now, self._codec.counter(identifier, data))
        if name in self._counters and not self._in_sequence(name, identifier, data):
            self._monitor.fault(name)
            return
        self._monitor.observe(name, decoded, since)
        if self._control:
            self._control.observe(name, decoded, now)

    def _in_sequence(self, name: str, identifier: int, data: bytes) -> bool:
        """Whether the counter moved; lost frames before this one are no fault of it.

        A repeated counter is a fault after a pause as well, although it may have wrapped once.
        """
        counter = self._codec.counter(identifier, data)
        last, self._counters[name] = self._counters[name], counter
        return counter is None or counter != last

    def _record(self, message: can.Message, time_ns: int, own: bool) -> None:
        flags = (
            (EXTENDED if message.is_extended_id else 0)
            | (FD if message.is_fd else 0)
            | (BIT_RATE_SWITCH if message.bitrate_switch else 0)
            | (REMOTE if message.is_remote_frame else 0)
            | (ERROR if message.is_error_frame else 0)
            | (SENT if own else 0)
        )
        if not self._ring.append(time_ns, message.arbitration_id, flags, bytes(message.data)):
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
        self.refused = not self._put(*self._sender.encode(command), now)
        if not self.refused:
            self._last = command

    def _report(self, number: int, now: float) -> None:
        if now < self._status_due:
            return
        self._status_due = now + STATUS_PERIOD - 1e-6
        trip = self.state.trip.reason if self.state.trip else TripReason.NONE
        holding = self.state.phase in HOLDING
        authority = self._plan.authority if holding else Authority.NONE
        self._put(*self._sender.encode(TrialStatus(self.state.phase, authority, trip, number)), now)

    def _put(self, identifier: int, data: bytes, now: float) -> bool:
        """Send a frame; a bus that refuses several counts as off until it accepts one."""
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        try:
            self._bus.send(message)
        except can.CanError as fault:
            self._refused(fault)
            return False
        self._refused_in_a_row = 0
        self._own.sent(identifier, data)
        if self._own.silent:  # never echoed: the record gives the time of sending
            self._record(message, round(now * SECOND), own=True)
        return True

    def _refused(self, fault: can.CanError) -> None:
        self._refused_in_a_row += 1
        if len(self.refusals) < MOST_NOTES:
            self.refusals.append(str(fault))


def _carries_nothing(message: can.Message) -> bool:
    """Whether a frame cannot be one of the bench's messages, all of which are 11-bit data."""
    return message.is_remote_frame or message.is_extended_id


def _cycles(database: Database) -> dict[str, float]:
    """Cycle time in s of each periodic message."""
    return {
        message.name: message.cycle_time
        for message in database.messages
        if message.cycle_time and not message.attributes.get("GenMsgSendType")
    }
