"""State of a trial from the frames of its recording, as the gateway and its monitor compute it.

The receiver and the vehicle monitor are those of the gateway, fed with the recorded frames; what the
bench sends never depends on them here.
"""

import math
from collections import Counter
from dataclasses import dataclass

from slipbench.bench.gateway.receiver import Receiver
from slipbench.bench.safety.trial import HOLDING, not_ready
from slipbench.bench.safety.vehicle_monitor import VehicleMonitor
from slipbench.bench.safety.vehicle_state import VehicleState
from slipbench.bench.view.limits import AtButton, used_limits
from slipbench.bench.view.recent_load import RecentLoad
from slipbench.bench.view.recorded_trial import RecordedTrial
from slipbench.bench.view.turn_speed import TurnSpeed
from slipbench.protocol.codec.faults import FrameFault
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Phase,
    ToothIntervals,
    TrialStatus,
    TripReason,
)
from slipbench.protocol.logs.candump import parse_pieces
from slipbench.protocol.logs.frame_log import FrameLog

SAMPLE = 0.01  # s between two samples of the strip charts
SAMPLED = ("time", "throttle_request", "throttle", "slip", "wheel_speed", "speed", "engine_speed")


@dataclass(frozen=True)
class Observed:
    """State of the trial after the last frames. time: s; command: None before the first one.

    slip  of the rear wheel over its last turn; that of `vehicle`, which can trip, is of one frame
    """

    time: float
    phase: Phase | None
    trip: TripReason
    vehicle: VehicleState
    slip: float
    command: ActuatorCommand | None
    not_armed: str
    limits: dict[str, float]
    bus_load: dict[str, float]
    faults: dict[str, int]
    frames: int


class TrialObserver:
    """Receiver and monitor over the frames of one recording."""

    def __init__(self, recorded: RecordedTrial) -> None:
        """Begin before the first frame. Raises InputError where the binding does not suit."""
        trial = recorded.plan.trial
        self._recorded, self._limits = recorded, trial.limits
        self._codec = recorded.binding.codec()
        self._reports = self._codec.has("TrialStatus")  # else phase from authority alone
        self._receiver = Receiver(
            recorded.binding,
            self._codec,
            recorded.wheels,
            trial.limits.stale,
            trial.operating_point.gear,
        )
        self._monitor = VehicleMonitor(recorded.wheels)
        self._vehicle, self._now, self._sample_due = VehicleState(), -math.inf, -math.inf
        self._phase: Phase | None = None
        self._trip = TripReason.NONE
        self._command: ActuatorCommand | None = None
        self._begun: AtButton | None = None
        self._faults: Counter[str] = Counter()
        self._load = RecentLoad(recorded.bitrate)
        self._wheel = TurnSpeed(recorded.wheels, averaged=not self._codec.has("RearWheelSpeed"))
        self._samples: list[tuple[float, ...]] = []
        self.frames = 0

    def observe(self, lines: bytes) -> FrameLog | None:
        """Process complete candump lines, in order of time. Returns their frames, if any."""
        if not lines:
            return None
        log = parse_pieces([lines], str(self._recorded.folder), [])
        for kind, count in log.skipped:
            self._faults[kind] += count
        if not len(log):
            return None
        self._load.add(log)
        self.frames += len(log)
        number = [self._number(name) for name in log.buses]
        width, payload = log.data.shape[1], log.data.tobytes()
        columns = (log.time_ns, log.bus, log.identifier, log.extended, log.sent, log.length)
        rows = zip(*(column.tolist() for column in columns), strict=True)
        for row, (time_ns, bus, identifier, extended, sent, length) in enumerate(rows):
            now = time_ns * 1e-9
            if now >= self._sample_due:
                self._sample(now)
            self._now = max(self._now, now)
            data = payload[row * width : row * width + length]
            if number[bus] is None:
                continue
            if sent:
                self._sent(identifier, data, extended, number[bus], now)
            else:
                self._received((identifier, extended), data, number[bus], now)
        return log

    def skipped(self) -> None:
        """State that frames before the next ones were not read: the button may have been pressed there."""
        self._receiver.forget()
        if self._phase not in HOLDING:
            self._phase = None

    def samples(self) -> list[tuple[float, ...]]:
        """Remove and return the samples since the last call: `SAMPLED`, SI units, shape (n, 7)."""
        taken, self._samples = self._samples, []
        return taken

    def observed(self) -> Observed:
        """State after the last frame."""
        vehicle = self._state(self._now)
        return Observed(
            self._now,
            self._phase,
            self._trip,
            vehicle,
            self._wheel.slip(vehicle.speed),
            self._command,
            not_ready(vehicle, self._recorded.plan) if self._phase in (None, Phase.IDLE) else "",
            used_limits(vehicle, self._command, self._begun, self._limits),
            self._load.shares(),
            dict(self._faults),
            self.frames,
        )

    def _number(self, name: str) -> int | None:
        buses = self._recorded.buses
        return buses.index(name) if name in buses else None

    def _received(self, key: tuple[int, bool], data: bytes, bus: int, now: float) -> None:
        for name, content, time in self._receiver.receive(key, data, now, now, bus):
            if isinstance(content, FrameFault):
                self._monitor.fault(name)
                self._faults[f"{content.message or name}: {content.fault}"] += 1
            else:
                self._monitor.observe(name, content, time)
                if name == "RearTeeth" and isinstance(content, ToothIntervals):
                    self._wheel.observe(content)

    def _sent(self, identifier: int, data: bytes, extended: bool, bus: int, now: float) -> None:
        if self._codec.plan(identifier, extended, bus) is None:
            return
        match self._codec.decode(identifier, data, extended, bus):
            case ActuatorCommand() as command:
                if not self._reports:
                    self._enter(Phase.EXCITING if command.authority else Phase.IDLE, now)
                self._command = command
                self._receiver.requested(command, now)
            case TrialStatus(phase, _, trip):
                self._enter(phase, now)
                self._trip = trip

    def _enter(self, phase: Phase, now: float) -> None:
        if self._phase is not None and phase in HOLDING and self._phase not in HOLDING:
            self._monitor.start_distance(now)
            vehicle = self._state(now)
            self._begun = AtButton(
                vehicle.ecu.throttle_command,
                vehicle.rider.grip,
                vehicle.engine.engine_speed,
                vehicle.speed,
            )
        self._phase = phase

    def _state(self, now: float) -> VehicleState:
        for name, status, time in self._receiver.assumed(now):
            if not isinstance(status, FrameFault):
                self._monitor.observe(name, status, time)
        self._vehicle = self._monitor.state(now)
        return self._vehicle

    def _sample(self, now: float) -> None:
        """Append one sample; a time without frames gives none."""
        self._sample_due = max(self._sample_due + SAMPLE, now + SAMPLE / 2)
        vehicle, command = self._state(now), self._command
        requested = command.throttle if command and command.authority else math.nan
        self._samples.append(
            (
                now,
                requested,
                vehicle.throttle.position,
                self._wheel.slip(vehicle.speed),
                self._wheel.speed,
                vehicle.speed,
                vehicle.engine.engine_speed,
            )
        )
