"""Laws of the receiving side: ages, counters, senders, and what a binding replaces."""

import math
from collections.abc import Iterable
from dataclasses import replace
from random import Random
from typing import NamedTuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from slipbench import dbc
from slipbench.bench.gateway.receiver import MOST_REQUESTS, Receiver
from slipbench.bench.gateway.wheel_speed import SLOWEST, WheelSpeedTeeth
from slipbench.bench.safety.vehicle_monitor import VehicleMonitor, Wheels
from slipbench.protocol.binding.binding import Binding
from slipbench.protocol.codec.codec import Codec, Frame, Sender
from slipbench.protocol.codec.faults import Fault, FrameFault
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    BenchMessage,
    EcuStatus,
    EncoderStatus,
    EngineStatus,
    Intervals,
    OpticalSpeed,
    ThrottleStatus,
    ToothIntervals,
    WheelSpeed,
)
from slipbench.protocol.codec.placement import OWN, FieldsAt, SignalAt, TeethAt
from slipbench.protocol.database.database import load_database
from slipbench.protocol.database.layout import Checksum, Database, Message, Protection, Signal
from slipbench.protocol.recording.message_rules import Degraded

WHEELS = Wheels(0.32, 0.30, 16)
NAN = math.nan
STALE = 0.020
GEAR = 2
PROTECTIONS = {
    "counter of 16": Protection(0, counter="cnt"),
    "counter of 10": Protection(0, counter="cnt", period=10),
    "counter and sum": Protection(0, counter="cnt", checksum=Checksum("crc", "sum")),
    "E2E1": Protection(1, 0x77),
    "E2E2": Protection(2, 0, bytes(range(16))),
}
HEADER = (Signal("crc", 0, 8), Signal("cnt", 8, 4))
TWO = Protection(0, counter="cnt")


def database(protection: Protection | None = TWO) -> Database:
    """Engine in two frames, throttle body in a third, ECU, wheel speeds and optical speed."""
    rpm = Signal("rpm", 16, 16, scale=0.25, unit="rpm")
    position = Signal("pos", 16, 16, scale=0.01, unit="%")
    return Database(
        "made.dbc",
        "",
        (
            Message("Engine", 1, 4, (*HEADER, rpm), cycle_time=0.005, protection=protection),
            Message("Gear", 2, 1, (Signal("gear", 0, 4),), cycle_time=0.005),
            Message("Body", 3, 4, (*HEADER, position), cycle_time=0.002, protection=protection),
            Message(
                "Ecu", 4, 4, (Signal("mode", 0, 2), replace(position, name="set")), cycle_time=0.001
            ),
            Message("Wheel", 5, 2, (Signal("v", 0, 16, scale=0.01, unit="m/s"),), cycle_time=0.005),
            Message("Speed", 6, 2, (Signal("v", 0, 16, scale=0.01, unit="m/s"),), cycle_time=0.005),
        ),
    )


PLACEMENT = {
    "EngineStatus": {
        "engine_speed": SignalAt("Engine", "rpm", to="rad/s"),
        "gear": SignalAt("Gear", "gear"),
        "spark_advance": NAN,
        "time": NAN,
    },
    "ThrottleStatus": {
        "authority": Authority.NONE,
        "position": SignalAt("Body", "pos", to=""),
        "motor_current": NAN,
        "faulty": False,
        "time": NAN,
    },
    "EcuStatus": {
        "authority": SignalAt("Ecu", "mode", values={0: 0, 1: 1, 2: 2, 3: 3}),
        "throttle_command": SignalAt("Ecu", "set", to=""),
        "spark_command": 0.0,
        "time": NAN,
    },
    "FrontWheelSpeed": {"speed": SignalAt("Wheel", "v", to="m/s")},
    "OpticalSpeed": {"speed": SignalAt("Speed", "v", to="m/s"), "valid": True, "time": NAN},
}


class Received(NamedTuple):
    name: str
    message: BenchMessage | FrameFault
    time: float


def received(found: Iterable[tuple[str, BenchMessage | FrameFault, float]]) -> list[Received]:
    return [Received(*each) for each in found]


class Bus:
    """A receiver, and a sender of each message that it hears. others: places of more messages."""

    def __init__(
        self,
        degraded: Degraded | None = None,
        timeouts: dict[str, float] | None = None,
        without: tuple[str, ...] = (),
        protection: Protection | None = TWO,
        made: Database | None = None,
        **others: FieldsAt | TeethAt,
    ) -> None:
        placement = {name: at for name, at in PLACEMENT.items() if name not in without} | others
        self.binding = Binding(
            made or database(protection), placement, timeouts or {}, degraded or Degraded()
        )
        self.codec = Codec(self.binding.database, placement)
        self.sender = Sender(self.codec)
        self.receiver = Receiver(self.binding, self.codec, WHEELS, STALE, GEAR)

    def send(self, message, now: float, name: str | None = None) -> list[Received]:
        """What the receiver makes of all frames of a message at `now` (s)."""
        frames = self.sender.frames(message, name=name)
        return [each for frame in frames for each in self.hear(frame, now)]

    def assumed(self, now: float) -> list[Received]:
        return received(self.receiver.assumed(now))

    def hear(self, frame: Frame, now: float, since: float | None = None) -> list[Received]:
        since = now if since is None else since
        return received(
            self.receiver.receive((frame.identifier, frame.extended), frame.data, now, since)
        )


ENGINE = EngineStatus(1000.0, 3, NAN, NAN)
BODY = ThrottleStatus(Authority.NONE, 0.25, NAN, False, NAN)
ECU = EcuStatus(Authority.THROTTLE, 0.5, 0.0, NAN)
COMMAND = ActuatorCommand(Authority.THROTTLE, 0.4, -0.1, 0.0)


def faults(received: list[Received]) -> list[str]:
    return [each.name for each in received if isinstance(each.message, FrameFault)]


def test_a_message_is_as_old_as_its_oldest_field():
    bus = Bus()
    engine, gear = bus.sender.frames(ENGINE)
    assert bus.hear(engine, 1.000) == []
    (first,) = bus.hear(gear, 1.004)
    assert (first.name, first.time, first.message.gear) == ("EngineStatus", 1.000, 3)
    (second,) = bus.hear(bus.sender.frames(ENGINE)[0], 1.005)
    assert second.time == 1.004
    (third,) = bus.hear(gear, 1.009)
    assert third.time == 1.005


def test_a_frame_whose_counter_stands_still_makes_nothing_new():
    """The gear goes on coming; the engine speed is as old as its last good frame."""
    bus = Bus()
    bus.send(ENGINE, 1.0)
    (stuck, gear) = bus.sender.frames(ENGINE)
    bus.hear(stuck, 1.005)
    for number in range(1, 6):
        now = 1.005 + 0.005 * number
        assert faults(bus.hear(stuck, now)) == ["EngineStatus"]
        (joined,) = bus.hear(gear, now)
        assert joined.time == 1.005


@pytest.mark.parametrize("name", PROTECTIONS)
def test_each_kind_of_counter_shows_a_repeated_frame_and_only_that(name):
    bus = Bus(protection=PROTECTIONS[name])
    period = bus.codec.plan(3).guard.period
    frames = [bus.sender.frames(BODY)[0] for _ in range(2 * period + 3)]
    for number, frame in enumerate(frames):
        now = 0.002 * number
        (good,) = bus.hear(frame, now)
        assert good == Received("ThrottleStatus", good.message, now)
        assert isinstance(good.message, ThrottleStatus)
        (again,) = bus.hear(frame, now + 0.001)
        assert (again.name, again.message.fault) == ("ThrottleStatus", Fault.REPEATED)
        if number % 3 == 0:  # a frame that was lost is no fault of the next one
            bus.sender.frames(BODY)


def test_a_repeated_frame_is_a_fault_after_any_pause():
    bus = Bus()
    (frame,) = bus.sender.frames(BODY)
    bus.hear(frame, 1.0)
    assert faults(bus.hear(frame, 9.0)) == ["ThrottleStatus"]


@pytest.mark.parametrize("name", PROTECTIONS)
def test_two_senders_are_found_by_their_counters_whatever_their_period(name):
    bus = Bus(protection=PROTECTIONS[name])
    period = bus.codec.plan(3).guard.period
    other = Sender(bus.codec)
    other.counters["Body"] = period // 2
    for number in range(40):
        sender = other if number % 2 else bus.sender
        bus.hear(sender.frames(BODY)[0], 0.001 * number)
        if bus.receiver.trouble:
            break
    assert "Body is counted by more than one sender" in bus.receiver.trouble
    assert number < 20
    bus.receiver.forget()


@pytest.mark.parametrize("name", PROTECTIONS)
def test_one_sender_through_many_turns_of_its_counter_is_no_trouble(name):
    print("seed", name)
    random, bus = Random(name), Bus(protection=PROTECTIONS[name])
    for number in range(400):
        (frame,) = bus.sender.frames(BODY)
        if random.random() > 0.05:
            bus.hear(frame, 0.002 * number)
    assert bus.receiver.trouble == ""


def test_two_senders_of_a_counter_of_one_byte_are_found_where_it_is_high():
    signals = (Signal("cnt", 8, 8), Signal("pos", 16, 16, scale=0.01, unit="%"))
    wide = Message("Body", 3, 4, signals, cycle_time=0.002, protection=TWO)
    bus = Bus(
        made=Database("made.dbc", "", (wide,)),
        without=tuple(name for name in PLACEMENT if name != "ThrottleStatus"),
    )
    other = Sender(bus.codec)
    bus.sender.counters["Body"], other.counters["Body"] = 100, 200
    for number in range(20):
        sender = other if number % 2 else bus.sender
        bus.hear(sender.frames(BODY)[0], 0.001 * number)
    assert "Body is counted by more than one sender" in bus.receiver.trouble


def own_bus(degraded: Degraded, without: tuple[str, ...] = ()) -> Bus:
    """The bench's own database, as a binding may have it."""
    bus = Bus(degraded)
    placement = {name: at for name, at in OWN.items() if name not in without}
    bus.binding = Binding(load_database(dbc.MOTORBIKE), placement, {}, degraded)
    bus.codec = bus.binding.codec()
    bus.sender = Sender(bus.codec)
    bus.receiver = Receiver(bus.binding, bus.codec, WHEELS, STALE, GEAR)
    return bus


def test_a_counter_that_stands_is_a_fault_only_where_authority_rests_on_the_message():
    bus = own_bus(Degraded())
    names = ("RearEncoderStatus", "OpticalSpeed")
    rear, optical = (bus.codec.identifier(name) for name in names)
    frames = {
        rear: bus.sender.frames(EncoderStatus(7, 0.5, 16, False), name="RearEncoderStatus")[0],
        optical: bus.sender.frames(OpticalSpeed(30.0, True, 0.0))[0],
    }
    for frame in frames.values():
        assert faults(bus.hear(frame, 0.0)) == []
    assert faults(bus.hear(frames[rear], 0.1)) == []
    assert faults(bus.hear(frames[optical], 0.1)) == ["OpticalSpeed"]


def test_a_sender_of_the_bench_s_own_message_is_another_bench():
    bus = Bus()
    made = Message("Demand", 9, 1, (Signal("on", 0, 2),))
    at = {"authority": SignalAt("Demand", "on"), "throttle": 0.0, "spark": 0.0, "time": 0.0}
    binding = replace(
        bus.binding,
        database=replace(bus.binding.database, messages=(*database().messages, made)),
        placement={**PLACEMENT, "ActuatorCommand": at},
    )
    receiver = Receiver(binding, binding.codec(), WHEELS, STALE, GEAR)
    receiver.receive((9, False), b"\x01", 0.0, 0.0)
    assert "another bench sends Demand" in receiver.trouble


@given(timeout=st.integers(2, 50), silence=st.integers(0, 80))
def test_a_status_is_stale_exactly_after_its_own_timeout(timeout, silence):
    """timeout, silence in ms; the limit of the trial is the longest."""
    bus = Bus(timeouts={"Body": timeout * 1e-3})
    monitor = VehicleMonitor(WHEELS)
    for name in ("EcuStatus", "EngineStatus", "RiderControls", "RearTeeth", "FrontTeeth"):
        monitor._received[name] = 1e6  # later than now: only what is heard below counts
    sent = 1.0
    for name, message, time in bus.send(BODY, sent):
        monitor.observe(name, message, time)
    age = sent + silence * 1e-3 - monitor._received["ThrottleStatus"]
    allowed = min(timeout * 1e-3, STALE)
    assert (age > STALE + 1e-9) == (silence * 1e-3 > allowed + 1e-9)


@pytest.mark.parametrize(("timeout", "earlier"), [(0.005, 0.015), (STALE, 0.0), (0.05, 0.0)])
def test_a_shorter_timeout_makes_its_own_message_older_and_no_other(timeout, earlier):
    """Times count from the reception before; a message is stale where it is older than STALE."""
    bus = Bus(timeouts={"Body": timeout})
    (body,), (engine, gear) = bus.sender.frames(BODY), bus.sender.frames(ENGINE)
    (found,) = bus.hear(body, 2.0, since=1.998)
    assert found.time == pytest.approx(1.998 - earlier, abs=1e-9)
    bus.hear(engine, 2.0, since=1.998)
    (found,) = bus.hear(gear, 2.0, since=1.998)
    assert found.time == 1.998


def test_a_fault_has_the_age_of_its_frame_and_its_name():
    """Too short, repeated, or without a meaning; each names the message that it should hold."""
    bus = Bus(
        EngineStatus={
            **PLACEMENT["EngineStatus"],
            "gear": SignalAt("Gear", "gear", unknown=(15.0,)),
        }
    )
    (body,) = bus.sender.frames(BODY)
    bus.hear(body, 1.0)
    for frame, name, carrier, fault in (
        (Frame(5, b"\0"), "FrontTeeth", "Wheel", Fault.SHORT),
        (body, "ThrottleStatus", "Body", Fault.REPEATED),
        (Frame(2, b"\x0f"), "EngineStatus", "EngineStatus", Fault.RANGE),
    ):
        ((found, content, time),) = bus.hear(frame, 3.0, since=2.0)
        assert (found, time) == (name, 2.0)
        assert (content.message, content.fault) == (carrier, fault)


def test_a_frame_that_is_too_short_is_a_fault_and_one_of_others_is_nothing():
    bus = Bus()
    assert faults(bus.hear(Frame(3, b"\x00"), 0.0)) == ["ThrottleStatus"]
    assert bus.hear(Frame(3, bytes(4), True), 0.0) == []  # a 29-bit identifier is another one
    assert bus.hear(Frame(0x7FF, bytes(8)), 0.0) == []


# What a binding replaces.


@pytest.mark.parametrize("latency", [0, 1, 3, 5, 7])
def test_a_request_counts_as_applied_after_its_latency(latency):
    """latency: ms. Times of day in s are coarse floats; the echo does not jitter with them."""
    bus, start = Bus(Degraded(echo=f"{latency} ms")), 1_790_000_000.0
    bus.send(BODY, start)
    for number in range(60):
        now = start + number * 1e-3
        bus.assumed(now)
        (status,) = bus.send(ECU, now)
        if number > 10:
            requested = number - max(1, latency)
            assert status.message.throttle_command == pytest.approx(0.001 * requested)
        bus.receiver.requested(replace(COMMAND, throttle=number * 1e-3), now)


def test_without_authority_the_assumed_echo_is_the_position_of_the_throttle():
    bus = Bus(Degraded(echo="0 ms"))
    bus.receiver.requested(COMMAND, 0.0)
    bus.send(BODY, 0.0)
    bus.assumed(0.001)
    (status,) = bus.send(replace(ECU, authority=Authority.NONE), 0.001)
    assert status.message.throttle_command == 0.25
    (status,) = bus.send(ECU, 0.002)
    assert status.message.throttle_command == COMMAND.throttle


def test_before_any_request_the_assumed_echo_is_none_and_nothing_is_known_of_the_throttle():
    bus = Bus(Degraded(echo="0 ms", throttle_body="follows_ecu"))
    bus.assumed(0.0)
    (free,) = bus.send(replace(ECU, authority=Authority.NONE), 0.0)
    assert math.isnan(free.message.throttle_command)
    assert free.message.spark_command == 0.0
    (held,) = bus.send(ECU, 0.0)
    assert held.message.throttle_command == 0.0
    (body,) = Bus(Degraded(throttle_body="follows_ecu")).send(BODY, 0.0)
    assert body.message.authority is Authority.NONE


def test_no_more_than_the_last_requests_are_kept():
    bus = Bus(Degraded(echo="100 ms"))
    for number in range(MOST_REQUESTS + 5):
        bus.receiver.requested(COMMAND, 1e-5 * number)
    assert len(bus.receiver._requests) == MOST_REQUESTS
    assert bus.receiver._requests[0][0] == pytest.approx(5e-5)


def test_where_silence_gives_back_the_last_request_holds_authority():
    bus = Bus(Degraded(hand_back="20 ms"))
    (before,) = bus.send(replace(ECU, authority=Authority.THROTTLE), 0.0)
    assert before.message.authority == Authority.NONE
    bus.receiver.requested(COMMAND, 0.0)
    bus.assumed(0.001)
    (held,) = bus.send(ECU, 0.001)
    assert held.message.authority == Authority.THROTTLE
    assert held.message.throttle_command == 0.5  # the echo is real
    bus.receiver.requested(replace(COMMAND, authority=Authority.NONE), 0.001)
    bus.assumed(0.002)
    (released,) = bus.send(ECU, 0.002)
    assert released.message.authority == Authority.NONE


def test_a_bus_without_any_status_of_the_ecu_has_an_assumed_one():
    bus = Bus(Degraded(hand_back="20 ms", echo="2 ms"), without=("EcuStatus",))
    bus.send(BODY, 0.0)
    (idle,) = bus.assumed(0.0)
    assert (idle.name, idle.time, idle.message.authority) == ("EcuStatus", 0.0, Authority.NONE)
    assert idle.message.throttle_command == 0.25
    bus.receiver.requested(COMMAND, 0.0)
    (early,) = bus.assumed(0.001)
    assert early.message.authority == Authority.NONE
    (applied,) = bus.assumed(0.002)
    assert replace(applied.message, time=0.0) == EcuStatus(Authority.THROTTLE, 0.4, -0.1, 0.0)
    assert Bus().assumed(0.0) == []


def test_a_throttle_body_that_says_nothing_follows_the_ecu():
    bus = Bus(Degraded(throttle_body="follows_ecu"))
    for authority in (Authority.NONE, Authority.THROTTLE, Authority.NONE):
        bus.send(replace(ECU, authority=authority), 0.0)
        (body,) = bus.send(BODY, 0.0)
        assert body.message.authority == authority
    (body,) = Bus().send(BODY, 0.0)
    assert body.message.authority == Authority.NONE


def test_a_gear_that_is_not_monitored_is_that_of_the_operating_point():
    assert Bus().send(ENGINE, 0.0)[0].message.gear == 3
    for without in ((), ("FrontWheelSpeed",)):
        bus = Bus(Degraded(unmonitored=("gear",)), without=without)
        assert bus.send(ENGINE, 0.0)[0].message.gear == GEAR


@pytest.mark.parametrize("speed", [0.5, 4.0, 10.0, 60.0])
def test_the_front_wheel_is_the_speed_where_no_optical_sensor_is(speed):
    """At every sample, also where no tooth of the imaginary encoder passed since the last one."""
    bus = Bus(Degraded(speed="front_wheel", wheels="wheel_speed"), without=("OpticalSpeed",))
    for number in range(20):
        found = bus.send(WheelSpeed(speed), 0.005 * number, name="FrontWheelSpeed")
        speeds = [each.message for each in found if each.name == "OpticalSpeed"]
        assert [each.valid for each in speeds] == [True]
        assert math.isnan(speeds[0].time)  # of a clock that no sensor has
        assert {each.time for each in found} == {0.005 * number}
        assert speeds[0].speed == pytest.approx(speed)
    bus = Bus()
    found = bus.send(WheelSpeed(speed), 0.0, name="FrontWheelSpeed")
    assert [each.name for each in found] == ["FrontTeeth"]
    (optical,) = bus.send(OpticalSpeed(speed, True, NAN), 0.0)
    assert optical.message.speed == pytest.approx(speed)


def test_each_wheel_has_teeth_of_its_own_radius_that_keep_pace_with_its_distance():
    rear = {"speed": SignalAt("Speed", "v", to="m/s")}
    bus = Bus(without=("OpticalSpeed",), RearWheelSpeed=rear)
    for name, to, radius in (("Rear", "RearTeeth", 0.32), ("Front", "FrontTeeth", 0.30)):
        pitch, teeth = 2 * math.pi * radius / 16, 0
        for number in range(101):
            ((heard, found, _),) = bus.send(WheelSpeed(20.0), 0.01 * number, f"{name}WheelSpeed")
            assert heard == to
            assert found.intervals[0] == pytest.approx(pitch / 20.0)
            teeth = found.tooth_count
        assert abs(teeth * pitch - 20.0) < pitch


def test_front_teeth_are_the_speed_where_no_optical_sensor_is():
    bus = own_bus(Degraded(speed="front_wheel"), without=("OpticalSpeed",))
    pitch = 2 * math.pi * WHEELS.front_radius / WHEELS.teeth
    intervals = tuple(pitch / speed for speed in (48.0, 50.0, 52.0))
    teeth = ToothIntervals(Intervals.SHORT, 3, intervals)
    first, optical = bus.send(teeth, 2.0, name="FrontTeeth")
    assert (first.name, first.message.layout, first.time) == ("FrontTeeth", Intervals.SHORT, 2.0)
    assert (optical.name, optical.time, optical.message.valid) == ("OpticalSpeed", 2.0, True)
    assert optical.message.speed == pytest.approx(3 * pitch / sum(intervals), rel=1e-3)
    assert [each.name for each in bus.send(teeth, 2.0, name="RearTeeth")] == ["RearTeeth"]
    standing = ToothIntervals(Intervals.STANDING, 3, (0.5,))
    assert [each.name for each in bus.send(standing, 2.1, name="FrontTeeth")] == ["FrontTeeth"]


# Wheel speeds as teeth of an imaginary encoder.

SPEEDS = st.lists(
    st.tuples(st.floats(SLOWEST, 120.0), st.floats(1e-4, 0.05)), min_size=2, max_size=60
)


@given(samples=SPEEDS, pitch=st.floats(0.02, 0.3))
def test_teeth_keep_pace_with_the_distance_and_give_the_speed(samples, pitch):
    teeth, now, distance, before = WheelSpeedTeeth(pitch), 0.0, 0.0, 0
    for number, (speed, step) in enumerate(samples):
        if number:
            now += step
            distance += speed * step
        found = teeth.take(speed, now)
        assert found.intervals == (pytest.approx(pitch / speed),) * len(found.intervals)
        passed = found.tooth_count - before
        before = found.tooth_count
        if found.layout is Intervals.STANDING:
            assert (passed, len(found.intervals)) == (0, 1)
        else:
            assert passed == len(found.intervals) > 0
        assert abs(found.tooth_count * pitch - distance) < pitch * (1 + 1e-6) + 1e-6


def test_no_tooth_passes_with_the_first_sample_nor_while_the_wheel_stands():
    """The interval of a wheel that stands is that of the slowest speed."""
    teeth = WheelSpeedTeeth(0.12)
    assert teeth.take(60.0, 0.0) == ToothIntervals(Intervals.STANDING, 0, (0.12 / 60.0,))
    assert teeth.take(0.0, 0.001) == ToothIntervals(Intervals.STANDING, 0, (0.12 / SLOWEST,))
    assert teeth.take(60.0, 0.0025) == ToothIntervals(Intervals.STANDING, 0, (0.12 / 60.0,))
    assert teeth.take(60.0, 0.0055) == ToothIntervals(Intervals.SHORT, 2, (0.12 / 60.0,) * 2)


def test_a_wheel_that_stands_has_no_teeth_and_time_that_goes_back_adds_none():
    teeth = WheelSpeedTeeth(0.12)
    for now in (0.0, 1.0, 5.0):
        assert teeth.take(0.0, now).layout is Intervals.STANDING
        assert teeth.take(-3.0, now).tooth_count == 0
    assert isinstance(teeth.take(50.0, 5.1), ToothIntervals)
    count = teeth.take(50.0, 5.2).tooth_count
    assert teeth.take(50.0, 5.0).tooth_count == count
