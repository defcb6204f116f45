"""The messages of the bench, in SI, as the programs on the bus use them.

Field names are the signal names of the database; the codec converts units, once.
Times are the sender's own clock, s, and running counts begin at any value; both are
given to the codec unwrapped, wrap on the wire at their signals' widths, and are unwrapped by the
reader (`slipbench.protocol.codec.unwrap`).
"""

from dataclasses import dataclass
from enum import IntEnum

# Clocks and running counts of these messages. They wrap at their signals' widths by definition, also
# where a database lacks the attribute SignalWraps, which no other editor writes.
WRAPPING = frozenset({"time", "tooth_time", "tooth_count", "tick"})


class Authority(IntEnum):
    """Actuators that the bench requests or controls."""

    NONE = 0
    THROTTLE = 1
    SPARK = 2
    BOTH = 3


class Phase(IntEnum):
    """Phase of a trial."""

    IDLE = 0
    ARMED = 1
    EXCITING = 2
    SETTLING = 3
    HANDING_BACK = 4
    DONE = 5
    TRIPPED = 6


class TripReason(IntEnum):
    """Why the bench gave authority back before the trial was done."""

    NONE = 0
    BUTTON_RELEASED = 1
    BRAKE = 2
    CLUTCH = 3
    GRIP_CLOSED = 4
    GEAR = 5
    ENGINE_SPEED = 6
    SPEED = 7
    SLIP = 8
    DISTANCE = 9
    STALE = 10
    FAULTY = 11
    BUS_OFF = 12
    AMPLITUDE = 13
    RATE = 14
    RANGE = 15
    AUTHORITY_LOST = 16
    RECORDER = 17
    STOPPED = 18
    NEVER_PRESSED = 19
    THROTTLE_FAULT = 20
    TWO_SENDERS = 21
    NEVER_READY = 22
    TIMING = 23
    FRONT_WHEEL = 24
    GRIP_OPENED = 25
    INTERNAL_ERROR = 26


class Intervals(IntEnum):
    """How a tooth frame holds its intervals: many short ones, or few long ones."""

    SHORT = 0
    LONG = 1
    SINGLE = 2
    STANDING = 3


@dataclass(frozen=True, slots=True)
class ActuatorCommand:
    """Gateway to ECU and throttle, every 1 ms; also the heartbeat that keeps authority."""

    authority: Authority
    throttle: float  # requested opening, 0..1
    spark: float  # offset from the map, rad, positive advances
    time: float  # s, gateway clock


@dataclass(frozen=True, slots=True)
class EcuStatus:
    """ECU, every 1 ms: what it applied, and when."""

    authority: Authority  # held by the bench at this moment
    throttle_command: float  # opening commanded to the servo, 0..1, from the bench or the rider
    spark_command: float  # offset applied to the map, rad
    time: float  # s, ECU clock


@dataclass(frozen=True, slots=True)
class ThrottleStatus:
    """Throttle body, every 1 ms."""

    authority: Authority
    position: float  # 0..1
    motor_current: float  # A
    faulty: bool
    time: float  # s, throttle clock


@dataclass(frozen=True, slots=True)
class EngineStatus:
    """ECU, every 5 ms."""

    engine_speed: float  # rad/s
    gear: int  # 0 neutral
    spark_advance: float  # applied, before top dead centre, rad
    time: float  # s, ECU clock


@dataclass(frozen=True, slots=True)
class ToothIntervals:
    """Encoder, whenever enough teeth have passed or the oldest has waited long enough.

    `tooth_count` is the running count of the last tooth of the frame, `intervals` the times between
    successive teeth that end with it, oldest first: on the classic bus 1 to 3 of up to 16.383 ms
    (SHORT), 1 or 2 of up to 1.048 s (LONG), or one (SINGLE). A STANDING frame carries no interval:
    its single number is the time since the last tooth.
    """

    layout: Intervals
    tooth_count: int
    intervals: tuple[float, ...]  # s


@dataclass(frozen=True, slots=True)
class EncoderStatus:
    """Encoder, every 100 ms: an absolute anchor for the intervals, and its health."""

    tooth_count: int  # same count as in ToothIntervals; on the wire it has more bits
    tooth_time: float  # s, encoder clock, of that tooth
    teeth_per_turn: int
    faulty: bool


@dataclass(frozen=True, slots=True)
class WheelSpeed:
    """Peripheral speed of one wheel, of a motorcycle that sends no tooth times."""

    speed: float  # m/s


@dataclass(frozen=True, slots=True)
class OpticalSpeed:
    """Optical sensor, every 4 ms."""

    speed: float  # m/s
    valid: bool
    time: float  # s, sensor clock


@dataclass(frozen=True, slots=True)
class RiderControls:
    """Rider's controls, every 5 ms."""

    button: bool
    grip: float  # 0..1
    front_brake: float  # Pa
    rear_brake: float  # Pa
    clutch: float  # 0 released .. 1 pulled


@dataclass(frozen=True, slots=True)
class ChassisStatus:
    """ECU, every 5 ms."""

    front_travel: float  # m
    rear_travel: float  # m


@dataclass(frozen=True, slots=True)
class Temperatures:
    """ECU, every 500 ms."""

    coolant: float  # K
    intake_air: float  # K
    rear_tyre: float  # K
    front_tyre: float  # K


@dataclass(frozen=True, slots=True)
class TrialStatus:
    """Gateway, every 20 ms: for the dashboard and the record."""

    phase: Phase
    authority: Authority
    trip: TripReason
    tick: int  # running count of the gateway's ticks


BenchMessage = (
    ActuatorCommand
    | EcuStatus
    | ThrottleStatus
    | EngineStatus
    | ToothIntervals
    | EncoderStatus
    | WheelSpeed
    | OpticalSpeed
    | RiderControls
    | ChassisStatus
    | Temperatures
    | TrialStatus
)
