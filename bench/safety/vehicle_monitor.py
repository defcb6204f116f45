"""The vehicle monitor: decoded frames in, the state of rider and motorcycle at each tick out."""

import math
from dataclasses import dataclass

from slipbench.bench.safety.vehicle_state import (
    NO_ECU,
    NO_ENGINE,
    NO_RIDER,
    NO_THROTTLE,
    VehicleState,
)
from slipbench.protocol.codec.messages import (
    EcuStatus,
    EncoderStatus,
    EngineStatus,
    Intervals,
    OpticalSpeed,
    RiderControls,
    ThrottleStatus,
    ToothIntervals,
)

SLOWEST = 3.0  # m/s: below it the slip is unknown: noise divided by almost nothing

# The statuses that a decision to keep authority rests on, by the name of their message.
SAFETY = (
    "EcuStatus",
    "ThrottleStatus",
    "EngineStatus",
    "RiderControls",
    "OpticalSpeed",
    "RearTeeth",
    "FrontTeeth",
)


@dataclass(frozen=True)
class Wheels:
    """Wheel geometry for speeds from tooth intervals.

    rear_radius, front_radius  m, rolling
    teeth                      per turn, of either encoder
    """

    rear_radius: float
    front_radius: float
    teeth: int


class VehicleMonitor:
    """The last good message of each kind and its age."""

    def __init__(self, wheels: Wheels) -> None:
        """Begin without any message."""
        self._pitch = {  # m of tread per tooth
            "RearTeeth": 2 * math.pi * wheels.rear_radius / wheels.teeth,
            "FrontTeeth": 2 * math.pi * wheels.front_radius / wheels.teeth,
        }
        self._received = dict.fromkeys(SAFETY, -math.inf)
        self._faults = dict.fromkeys(SAFETY, 0)
        self._wheel_speed = dict.fromkeys(self._pitch, math.nan)
        self._ecu, self._throttle, self._engine, self._rider = (
            NO_ECU,
            NO_THROTTLE,
            NO_ENGINE,
            NO_RIDER,
        )
        self._speed = math.nan
        self._stamps: dict[str, float] = {}  # the sender's own time, or its count of teeth
        self._unreliable: set[str] = set()  # whose encoder reports a fault
        self._distance = 0.0
        self._counted_until = math.nan

    def observe(self, name: str, message: object, now: float) -> None:
        """Store a frame of message `name` that arrived intact and in sequence at `now` (s)."""
        if name in self._unreliable or self._repeats_stamp(name, message):
            self.fault(name)
            return
        self._store(name, message)
        if name in self._received and not _invalid(message):
            self._received[name] = now
            self._faults[name] = 0

    def _store(self, name: str, message: object) -> None:
        match message:
            case EcuStatus():
                self._ecu = message
            case ThrottleStatus():
                self._throttle = message
            case EngineStatus():
                self._engine = message
            case RiderControls():
                self._rider = message
            case ToothIntervals():
                self._wheel_speed[name] = self._tooth_speed(name, message)
            case OpticalSpeed(speed, True):
                self._speed = speed
            case EncoderStatus():
                self._set_reliability(name.replace("EncoderStatus", "Teeth"), message.faulty)

    def fault(self, name: str) -> None:
        """Count a faulty frame of message `name`."""
        if name in self._faults:
            self._faults[name] += 1

    def start_distance(self, now: float) -> None:
        """Start the distance at 0 m at `now` (s)."""
        self._distance, self._counted_until = 0.0, now

    def state(self, now: float, *, bus_off: bool = False, recording: bool = True) -> VehicleState:
        """State of rider and motorcycle at `now` (s).

        A status received later than now, because time went back, has no known age: it is the oldest.
        """
        if not math.isnan(self._counted_until):
            self._distance += self._speed * (now - self._counted_until)
            self._counted_until = now
        ages = {name: now - received for name, received in self._received.items()}
        oldest = max(ages, key=lambda name: ages[name] if ages[name] >= 0.0 else math.inf)
        faulty = max(self._faults, key=self._faults.__getitem__)
        return VehicleState(
            self._ecu,
            self._throttle,
            self._engine,
            self._rider,
            self._speed,
            self._slip("RearTeeth"),
            self._slip("FrontTeeth"),
            self._distance,
            ages[oldest],
            oldest,
            self._faults[faulty],
            faulty,
            bus_off,
            recording,
        )

    def _set_reliability(self, name: str, faulty: bool) -> None:
        """Count frames of message `name` as faulty while its sender reports a fault."""
        if faulty:
            self._unreliable.add(name)
        else:
            self._unreliable.discard(name)

    def _repeats_stamp(self, name: str, message: object) -> bool:
        """Whether the sender's own time, or count of teeth, is that of its last frame.

        Counter and CRC of such a frame are right: the transmitter works, the
        measurement does not. The time without a tooth grows, so a wheel at rest is no such case.
        """
        match message:
            case EcuStatus() | ThrottleStatus() | EngineStatus() | OpticalSpeed():
                stamp = message.time
            case ToothIntervals(layout, count) if layout != Intervals.STANDING:
                stamp = float(count)
            case _:
                return False
        before = self._stamps.get(name)
        self._stamps[name] = stamp
        return stamp == before

    def _tooth_speed(self, name: str, teeth: ToothIntervals) -> float:
        """Peripheral speed, m/s; while no tooth comes, the most that the time without one allows."""
        span = sum(teeth.intervals)
        if span <= 0:
            return self._wheel_speed[name]
        if teeth.layout == Intervals.STANDING:
            return min(self._wheel_speed[name], self._pitch[name] / span)
        return self._pitch[name] * len(teeth.intervals) / span

    def _slip(self, name: str) -> float:
        if self._speed <= SLOWEST:
            return math.nan
        return self._wheel_speed[name] / self._speed - 1.0


def _invalid(message: object) -> bool:
    """Whether a sensor reports no valid value; it counts as silent."""
    return isinstance(message, OpticalSpeed) and not message.valid
