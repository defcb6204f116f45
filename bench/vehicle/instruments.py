"""Instruments of the virtual motorcycle: the message of each device, its period and its clock."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from slipbench.bench.vehicle.chassis import Chassis
from slipbench.bench.vehicle.devices import DeviceClock, Grant, Outbox
from slipbench.bench.vehicle.encoder_frames import EncoderFrames
from slipbench.bench.vehicle.rider import Rider
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import (
    Authority,
    BenchMessage,
    ChassisStatus,
    EcuStatus,
    EncoderStatus,
    EngineStatus,
    OpticalSpeed,
    Temperatures,
    ThrottleStatus,
    WheelSpeed,
)

MAP_ADVANCE = math.radians(36.0)  # before top dead centre; the map is flat at small openings
HOLDING_CURRENT = 1.5  # A against the return spring
CURRENT_PER_ACCELERATION = 3e-3  # A per 1/s^2 of the plate
TEMPERATURES = Temperatures(coolant=353.0, intake_air=308.0, rear_tyre=358.0, front_tyre=348.0)

# (period, phase) in ms. The phases differ, so that the devices do not all send in one millisecond.
SCHEDULE: Mapping[str, tuple[int, int]] = {
    "EcuStatus": (1, 0),
    "ThrottleStatus": (1, 0),
    "EngineStatus": (5, 1),
    "OpticalSpeed": (4, 2),
    "RiderControls": (5, 3),
    "ChassisStatus": (5, 4),
    "RearEncoderStatus": (100, 7),
    "FrontEncoderStatus": (100, 57),
    "Temperatures": (500, 9),
    "RearWheelSpeed": (5, 2),
    "FrontWheelSpeed": (5, 3),
}


TRUE_TIME = DeviceClock()


def unchanged(_: float, value: float) -> float:
    """Value without a measurement error."""
    return value


@dataclass(frozen=True)
class Timing:
    """How a device measures and sends one channel.

    clock    clock of its time stamps
    latency  s, from the time of the measurement to the frame
    noise    standard deviation of white noise, SI unit of the channel
    measure  (true time in s, value) -> value in the frame; called once for every frame, in order
    """

    clock: DeviceClock = TRUE_TIME
    latency: float = 0.0
    noise: float = 0.0
    measure: Callable[[float, float], float] = unchanged


class Motion(NamedTuple):
    """True motion of the motorcycle at one time, in SI units; the instruments measure it."""

    throttle: float
    throttle_acceleration: float  # 1/s^2
    engine_speed: float
    gear: int
    optical_speed: float  # after the dynamics of the optical sensor
    acceleration: float
    rear_angle: float
    front_angle: float
    rear_speed: float  # m/s, peripheral speed of the wheel
    front_speed: float


class Instruments:
    """Messages of all devices from the true motion, each with its period and latency."""

    def __init__(self, timings: Mapping[str, Timing], codec: Codec, rider: Rider, seed: int):
        """Measure with the timings of each channel; noise is drawn from `seed`."""
        self._timings, self._rider = timings, rider
        self._random = np.random.default_rng((seed, 1))
        self._outbox, self._chassis = Outbox(), Chassis()
        self._encoders = {
            name: EncoderFrames(codec.capacity(f"{name.capitalize()}Teeth"))
            for name in ("rear", "front")
            if codec.has(f"{name.capitalize()}Teeth")
        }
        self._schedule = {name: _scheduled(codec, name) for name in SCHEDULE if codec.has(name)}
        self._teeth_per_turn: dict[str, int] = {}
        self._sources: dict[str, Callable[[float, Motion, Grant], tuple[BenchMessage, float]]] = {
            "EcuStatus": self._ecu,
            "ThrottleStatus": self._throttle,
            "EngineStatus": self._engine,
            "OpticalSpeed": self._optical,
            "RiderControls": self._controls,
            "ChassisStatus": self._travel,
            "RearEncoderStatus": lambda *_: self._encoder("rear"),
            "FrontEncoderStatus": lambda *_: self._encoder("front"),
            "Temperatures": lambda *_: (TEMPERATURES, 0.0),
            "RearWheelSpeed": lambda _, motion, __: self._wheel("rear", motion.rear_speed),
            "FrontWheelSpeed": lambda _, motion, __: self._wheel("front", motion.front_speed),
        }

    def teeth(self, name: str, times: list[float], per_turn: int) -> None:
        """Add the true times (s) at which teeth passed the "rear" or "front" pickup."""
        if name not in self._encoders:
            return
        clock = self._timings[f"{name}_teeth"].clock
        self._teeth_per_turn[name] = per_turn
        self._encoders[name].add(round(clock.read(time) * 1e6) for time in times)

    def messages_due(
        self, number: int, now: float, motion: Motion, grant: Grant
    ) -> list[tuple[str, BenchMessage]]:
        """Names and messages that are sent in millisecond `number`, which ends at `now` (s)."""
        self._chassis.advance(motion.acceleration, 0.001)
        for name, (period, phase) in self._schedule.items():
            if number % period == phase:
                message, latency = self._sources[name](now, motion, grant)
                self._outbox.put(now + latency, name, message)
        for name, encoder in self._encoders.items():
            timing = self._timings[f"{name}_teeth"]
            for message in encoder.frames(int(timing.clock.read(now) * 1e6)):
                self._outbox.put(now + timing.latency, f"{name.capitalize()}Teeth", message)
        return self._outbox.due(now)

    def _measured(self, channel: str, now: float, value: float) -> float:
        """Value of a channel with its noise and measurement error, SI unit of the channel."""
        timing = self._timings[channel]
        if timing.noise:
            value += timing.noise * float(self._random.standard_normal())
        return timing.measure(now, value)

    def _ecu(self, now: float, motion: Motion, grant: Grant) -> tuple[BenchMessage, float]:
        timing, authority = self._timings["throttle_command"], grant.authority
        throttle = grant.command.throttle if authority & Authority.THROTTLE else self._rider.grip
        spark = grant.command.spark if authority & Authority.SPARK else 0.0
        throttle = min(max(self._measured("throttle_command", now, throttle), 0.0), 1.0)
        spark = self._measured("spark_command", now, spark)
        return EcuStatus(authority, throttle, spark, timing.clock.read(now)), timing.latency

    def _throttle(self, now: float, motion: Motion, grant: Grant) -> tuple[BenchMessage, float]:
        timing = self._timings["throttle_position"]
        position = min(max(self._measured("throttle_position", now, motion.throttle), 0.0), 1.0)
        current = HOLDING_CURRENT + CURRENT_PER_ACCELERATION * motion.throttle_acceleration
        current = min(max(current, -25.0), 25.0)
        status = ThrottleStatus(grant.authority, position, current, False, timing.clock.read(now))
        return status, timing.latency

    def _engine(self, now: float, motion: Motion, grant: Grant) -> tuple[BenchMessage, float]:
        timing = self._timings["engine_speed"]
        speed = max(self._measured("engine_speed", now, motion.engine_speed), 0.0)
        offset = grant.command.spark if grant.authority & Authority.SPARK else 0.0
        advance = MAP_ADVANCE + self._measured("spark_applied", now, offset)
        return EngineStatus(speed, motion.gear, advance, timing.clock.read(now)), timing.latency

    def _optical(self, now: float, motion: Motion, _: Grant) -> tuple[BenchMessage, float]:
        timing = self._timings["optical_speed"]
        speed = self._measured("optical_speed", now, motion.optical_speed)
        return OpticalSpeed(speed, True, timing.clock.read(now)), timing.latency

    def _controls(self, now: float, _: Motion, __: Grant) -> tuple[BenchMessage, float]:
        return self._rider.controls(now), self._timings["rider"].latency

    def _travel(self, now: float, motion: Motion, __: Grant) -> tuple[BenchMessage, float]:
        timing = self._timings["suspension_travel"]
        travels = self._chassis.travels(motion.rear_angle, motion.front_angle)
        front, rear = (
            max(self._measured("suspension_travel", now, travel), 0.0) for travel in travels
        )
        return ChassisStatus(front, rear), timing.latency

    def _encoder(self, name: str) -> tuple[BenchMessage, float]:
        frames = self._encoders[name]
        last = (frames.last_tooth or 0) * 1e-6
        return EncoderStatus(frames.count, last, self._teeth_per_turn.get(name, 1), False), 0.0

    def _wheel(self, name: str, speed: float) -> tuple[BenchMessage, float]:
        return WheelSpeed(max(speed, 0.0)), self._timings[f"{name}_teeth"].latency


def _scheduled(codec: Codec, name: str) -> tuple[int, int]:
    """Period and phase of a message in ms, where its frames come more often than here."""
    period, phase = SCHEDULE[name]
    cycles = [codec.plan_of(carrier).message.cycle_time for carrier in codec.carriers(name)]
    shortest = min((round(cycle * 1e3) for cycle in cycles if cycle), default=period)
    period = max(1, min(period, shortest))
    return period, phase % period
