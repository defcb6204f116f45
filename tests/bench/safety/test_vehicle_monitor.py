"""What the monitor makes of frames: the newest good status, its age, and whom it distrusts."""

import math

import pytest

from slipbench.bench.safety.vehicle_monitor import SAFETY, SLOWEST, VehicleMonitor, Wheels
from slipbench.bench.safety.vehicle_state import (
    NO_ECU,
    NO_ENGINE,
    NO_RIDER,
    NO_THROTTLE,
    VehicleState,
)
from slipbench.protocol.codec.messages import (
    Authority,
    EcuStatus,
    EncoderStatus,
    EngineStatus,
    Intervals,
    OpticalSpeed,
    RiderControls,
    Temperatures,
    ThrottleStatus,
    ToothIntervals,
)

NAN = math.nan
# A tooth every 0.25 m of tread behind, every 0.125 m in front.
WHEELS = Wheels(4.0 / (2 * math.pi), 2.0 / (2 * math.pi), 16)


def ecu(time=1.0):
    return EcuStatus(Authority.NONE, 0.25, 0.0, time)


def teeth(*intervals, count=1, layout=Intervals.SHORT):
    return ToothIntervals(layout, count, intervals)


def complete(now=16.0, time=1.0):
    """A monitor that has heard everything, at 32 m/s without slip."""
    monitor = VehicleMonitor(WHEELS)
    for name, message in {
        "EcuStatus": ecu(time),
        "ThrottleStatus": ThrottleStatus(Authority.NONE, 0.25, 0.0, False, time),
        "EngineStatus": EngineStatus(1280.0, 2, 0.5, time),
        "RiderControls": RiderControls(False, 0.25, 0.0, 0.0, 0.0),
        "OpticalSpeed": OpticalSpeed(32.0, True, time),
        "RearTeeth": teeth(0.0078125),
        "FrontTeeth": teeth(0.00390625),
    }.items():
        monitor.observe(name, message, now)
    return monitor


def test_who_has_heard_nothing_knows_nothing():
    nothing = VehicleMonitor(WHEELS).state(16.0)
    assert (nothing.ecu, nothing.throttle) == (NO_ECU, NO_THROTTLE)
    assert (nothing.engine, nothing.rider) == (NO_ENGINE, NO_RIDER)
    assert all(map(math.isnan, (nothing.speed, nothing.slip, nothing.front_slip)))
    assert (nothing.oldest_age, nothing.oldest) == (math.inf, "EcuStatus")
    assert (nothing.faults, nothing.faulty, nothing.distance) == (0, "EcuStatus", 0.0)


def test_who_has_heard_everything_tells_the_newest_of_each():
    sight = complete().state(16.0, bus_off=True, recording=False)
    assert sight == VehicleState(
        ecu(),
        ThrottleStatus(Authority.NONE, 0.25, 0.0, False, 1.0),
        EngineStatus(1280.0, 2, 0.5, 1.0),
        RiderControls(False, 0.25, 0.0, 0.0, 0.0),
        32.0,
        0.0,
        0.0,
        0.0,
        0.0,
        "EcuStatus",
        0,
        "EcuStatus",
        True,
        False,
    )
    assert (complete().state(16.0).bus_off, complete().state(16.0).recording) == (False, True)


@pytest.mark.parametrize("silent", SAFETY)
def test_the_age_is_that_of_the_status_that_has_been_silent_longest(silent):
    monitor, newer = complete(16.0), complete(16.0, 2.0)
    others = {
        "EcuStatus": newer.state(16.0).ecu,
        "ThrottleStatus": newer.state(16.0).throttle,
        "EngineStatus": newer.state(16.0).engine,
        "RiderControls": newer.state(16.0).rider,
        "OpticalSpeed": OpticalSpeed(32.0, True, 2.0),
        "RearTeeth": teeth(0.0078125, count=2),
        "FrontTeeth": teeth(0.00390625, count=2),
    }
    for name, message in others.items():
        if name != silent:
            monitor.observe(name, message, 17.0)
    sight = monitor.state(17.5)
    assert (sight.oldest, sight.oldest_age) == (silent, 1.5)


def test_what_was_heard_later_than_now_is_of_unknown_age_and_counts_as_the_oldest():
    """Time never goes back; if it did, whoever fell silent before must not look young."""
    monitor = complete(16.0)
    monitor.observe("RiderControls", RiderControls(False, 0.25, 0.0, 0.0, 0.0), 18.0)
    sight = monitor.state(17.0)
    assert (sight.oldest, sight.oldest_age) == ("RiderControls", -1.0)
    assert monitor.state(18.0).oldest != "RiderControls"


def test_what_safety_does_not_rest_on_ages_nothing():
    monitor = complete(16.0)
    monitor.observe("Temperatures", Temperatures(300.0, 300.0, 300.0, 300.0), 20.0)
    monitor.fault("Temperatures")
    assert monitor.state(20.0) == complete(16.0).state(20.0)


def test_faulty_frames_in_a_row_are_counted_and_a_good_one_ends_the_row():
    monitor = complete()
    for _ in range(2):
        monitor.fault("EngineStatus")
    monitor.fault("RearTeeth")
    assert (monitor.state(16.0).faults, monitor.state(16.0).faulty) == (2, "EngineStatus")
    monitor.observe("EngineStatus", EngineStatus(1280.0, 2, 0.5, 2.0), 16.0)
    assert (monitor.state(16.0).faults, monitor.state(16.0).faulty) == (1, "RearTeeth")


@pytest.mark.parametrize(
    ("name", "frozen"),
    [
        ("EcuStatus", ecu()),
        ("EngineStatus", EngineStatus(1300.0, 2, 0.5, 1.0)),
        ("ThrottleStatus", ThrottleStatus(Authority.NONE, 0.3, 0.0, False, 1.0)),
        ("OpticalSpeed", OpticalSpeed(33.0, True, 1.0)),
        ("RearTeeth", teeth(0.1)),
        ("FrontTeeth", teeth(0.1)),
    ],
)
def test_a_device_whose_own_time_stands_is_not_believed(name, frozen):
    """Counter and CRC are right: the part that sends lives, the part that measures does not."""
    monitor = complete(16.0)
    before = monitor.state(17.0)
    monitor.observe(name, frozen, 17.0)
    after = monitor.state(17.0)
    assert (after.faults, after.faulty) == (1, name)
    assert (after.ecu, after.engine, after.throttle) == (before.ecu, before.engine, before.throttle)
    assert (after.speed, after.slip, after.front_slip) == (
        before.speed,
        before.slip,
        before.front_slip,
    )


def test_controls_that_do_not_move_are_no_fault():
    monitor = complete(16.0)
    monitor.observe("RiderControls", RiderControls(False, 0.25, 0.0, 0.0, 0.0), 17.0)
    assert monitor.state(17.0).faults == 0


def test_an_optical_sensor_that_sees_nothing_is_as_silent_as_one_that_says_nothing():
    monitor = complete(16.0)
    monitor.observe("OpticalSpeed", OpticalSpeed(99.0, False, 2.0), 17.0)
    monitor.fault("OpticalSpeed")
    monitor.observe("OpticalSpeed", OpticalSpeed(99.0, False, 3.0), 17.0)
    assert (monitor.state(17.0).speed, monitor.state(17.0).faults) == (32.0, 1)
    assert monitor.state(17.0).oldest_age == 1.0


@pytest.mark.parametrize("side", ["Rear", "Front"])
def test_an_encoder_that_distrusts_itself_is_not_believed_until_it_does(side):
    """Its status comes every 100 ms and its teeth every few: no good-looking tooth clears it."""
    monitor = complete(16.0)
    monitor.observe(f"{side}EncoderStatus", EncoderStatus(1, 1.0, 16, True), 16.0)
    for count in (2, 3, 4):
        monitor.observe(f"{side}Teeth", teeth(0.001, count=count), 17.0)
    sight = monitor.state(17.0)
    assert (sight.faults, sight.faulty) == (3, f"{side}Teeth")
    assert (sight.slip, sight.front_slip) == (0.0, 0.0)
    monitor.observe(f"{side}EncoderStatus", EncoderStatus(1, 1.0, 16, False), 17.0)
    monitor.observe(f"{side}Teeth", teeth(0.0078125, count=5), 17.0)
    assert monitor.state(17.0).faults == 0


# Wheels


@pytest.mark.parametrize(
    ("said", "speed"),
    [
        (teeth(0.0078125, count=2), 32.0),
        (teeth(0.0078125, 0.015625, count=3), 0.5 / 0.0234375),  # the mean over all its teeth
        (teeth(0.0625, count=2, layout=Intervals.LONG), 4.0),
        (teeth(0.0625, count=2, layout=Intervals.SINGLE), 4.0),
        (teeth(0.0625, layout=Intervals.STANDING), 4.0),  # at most: no tooth came for so long
        (teeth(0.001, layout=Intervals.STANDING), 32.0),  # which says nothing yet
        (teeth(0.0, layout=Intervals.STANDING), 32.0),
    ],
)
def test_a_wheel_turns_as_its_teeth_say_and_no_faster_than_their_absence_allows(said, speed):
    monitor = complete()
    monitor.observe("RearTeeth", said, 16.0)
    assert monitor.state(16.0).slip == pytest.approx(speed / 32.0 - 1.0, abs=1e-12)
    assert monitor.state(16.0).front_slip == 0.0


def test_a_wheel_that_was_never_heard_to_turn_is_not_known():
    monitor = VehicleMonitor(WHEELS)
    monitor.observe("OpticalSpeed", OpticalSpeed(32.0, True, 1.0), 16.0)
    monitor.observe("FrontTeeth", teeth(0.0625, layout=Intervals.STANDING), 16.0)
    assert math.isnan(monitor.state(16.0).slip)
    assert math.isnan(monitor.state(16.0).front_slip)


@pytest.mark.parametrize(
    ("speed", "known"),
    [(SLOWEST, False), (math.nextafter(SLOWEST, 4.0), True), (-10.0, False), (NAN, False)],
)
def test_below_walking_pace_no_slip_is_known(speed, known):
    monitor = complete()
    monitor.observe("OpticalSpeed", OpticalSpeed(speed, True, 2.0), 16.0)
    assert math.isnan(monitor.state(16.0).slip) != known
    assert math.isnan(monitor.state(16.0).front_slip) != known


# The way on the straight


def test_distance_counts_from_the_button_by_the_speed_of_the_moment():
    monitor = complete()
    assert monitor.state(17.0).distance == 0.0
    monitor.start_distance(17.0)
    assert monitor.state(17.5).distance == 16.0
    monitor.observe("OpticalSpeed", OpticalSpeed(64.0, True, 2.0), 17.5)
    assert monitor.state(18.0).distance == 48.0
    monitor.start_distance(20.0)
    assert monitor.state(20.0).distance == 0.0


def test_a_distance_that_was_ever_unknown_stays_unknown():
    monitor = VehicleMonitor(WHEELS)
    monitor.start_distance(16.0)
    monitor.state(17.0)
    monitor.observe("OpticalSpeed", OpticalSpeed(64.0, True, 2.0), 17.0)
    assert math.isnan(monitor.state(18.0).distance)
