"""The lookout takes in decoded frames and says, at each tick, what is seen of the motorcycle."""

import math
from dataclasses import dataclass

from slipbench.bench.safety.vehicle_state import NO_ECU, NO_ENGINE, NO_RIDER, NO_THROTTLE, Seen
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

SLOWEST = 3.0  # m/s: below it a slip is noise over nothing, and not known

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
    """What turns tooth intervals into speeds.

    rear_radius, front_radius  m, rolling
    teeth                      per turn, of either encoder
    """

    rear_radius: float
    front_radius: float
    teeth: int


class VehicleMonitor:
    """Keeps the last good message of each kind, and how long ago it came."""

    def __init__(self, wheels: Wheels) -> None:
        """Know nothing yet."""
        self._pitch = {  # m of tread per tooth
            "RearTeeth": 2 * math.pi * wheels.rear_radius / wheels.teeth,
            "FrontTeeth": 2 * math.pi * wheels.front_radius / wheels.teeth,
        }
        self._heard = dict.fromkeys(SAFETY, -math.inf)
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
        self._distrusted: set[str] = set()  # whose encoder says that it is faulty
        self._distance = 0.0
        self._counted_until = math.nan

    def observe(self, name: str, message: object, now: float) -> None:
        """Take in a frame of message `name` that arrived whole and in sequence at `now` (s)."""
        if name in self._distrusted or self._tells_nothing_new(name, message):
            self.fault(name)
            return
        self._take_in(name, message)
        if name in self._heard and not _blind(message):
            self._heard[name] = now
            self._faults[name] = 0

    def _take_in(self, name: str, message: object) -> None:
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
                self._distrust(name.replace("EncoderStatus", "Teeth"), message.faulty)

    def fault(self, name: str) -> None:
        """Take note of a frame of message `name` that cannot be trusted."""
        if name in self._faults:
            self._faults[name] += 1

    def start_distance(self, now: float) -> None:
        """Measure the distance on the straight from here."""
        self._distance, self._counted_until = 0.0, now

    def seen(self, now: float, *, bus_off: bool = False, recording: bool = True) -> Seen:
        """Give the snapshot at `now` (s).

        What was heard later than now, since time went back, is of unknown age: the oldest of all.
        """
        if not math.isnan(self._counted_until):
            self._distance += self._speed * (now - self._counted_until)
            self._counted_until = now
        ages = {name: now - heard for name, heard in self._heard.items()}
        oldest = max(ages, key=lambda name: ages[name] if ages[name] >= 0.0 else math.inf)
        faulty = max(self._faults, key=self._faults.__getitem__)
        return Seen(
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

    def _distrust(self, name: str, faulty: bool) -> None:
        """Believe no frame of message `name` for as long as its sender says that it is faulty."""
        if faulty:
            self._distrusted.add(name)
        else:
            self._distrusted.discard(name)

    def _tells_nothing_new(self, name: str, message: object) -> bool:
        """Tell whether the sender's own time, or count of teeth, stands since its last frame.

        Counter and CRC of such a frame are right: the part that sends lives, the part that
        measures does not. Seconds without a tooth grow, so a wheel that stands is no such case.
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
        """Peripheral speed, m/s; while no tooth comes, the most that the silence allows."""
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


def _blind(message: object) -> bool:
    """Tell of a sensor that sees nothing; it is as silent as one that says nothing."""
    return isinstance(message, OpticalSpeed) and not message.valid
