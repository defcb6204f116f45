"""Safety requirements of a device that grants authority over the throttle to a bench.

The bench commands the throttle every millisecond (ActuatorCommand). While the commands are valid and
request authority, the device follows them; otherwise the throttle belongs to the rider.
"""

import pytest

WATCHDOG = 20.0  # ms without a valid command, after which the rider has the throttle
CYCLE = 1.0  # ms, of the device
GRANT = 10.0  # ms


def milliseconds(seconds):
    return 1e3 * seconds


def hand_back_after(begin, device, stimulus, within="200 ms"):
    """Time from `begin` (s) to the status that states the hand-back, ms."""
    return milliseconds(stimulus.wait_for(f"{device.authority} == 0", within) - begin)


@pytest.mark.requirement("SAF-1")
def test_no_authority_without_a_request(device, command, bus, measure):
    bus.run("300 ms")
    _, authority = bus.trace(device.authority)
    measure("authority without request", authority.max(), at_most=0, source=device.authority)


@pytest.mark.requirement("SAF-2")
def test_a_valid_request_is_granted_in_time(device, command, stimulus, bus, measure):
    bus.run("20 ms")
    begin = bus.now
    command.set(authority=1)
    granted = stimulus.wait_for(f"{device.authority} == 1", within="200 ms")
    limit = GRANT + device.delay
    measure("grant", milliseconds(granted - begin), "ms", at_most=limit, source=device.authority)


@pytest.mark.requirement("SAF-3")
def test_silence_gives_the_throttle_back(device, granted, stimulus, bus, measure):
    last = bus.times("ActuatorCommand")[-1]
    granted.stop()
    back = hand_back_after(last, device, stimulus)
    limit = WATCHDOG + CYCLE + device.delay
    measure("hand-back after silence", back, "ms", at_most=limit, source=device.authority)


@pytest.mark.requirement("SAF-4")
def test_after_a_watchdog_timeout_only_a_release_leads_to_a_new_grant(
    device, granted, stimulus, bus, measure
):
    granted.pause("50 ms")
    bus.run("50 ms")
    if bus.value(device.authority) != 0:
        pytest.skip("the watchdog did not act: see SAF-3")
    paused = bus.now
    bus.run("200 ms")
    _, authority = bus.trace(device.authority, since=paused)
    measure("authority without a release", authority.max(), at_most=0, source=device.authority)
    granted.set(authority=0)
    bus.run("20 ms")
    granted.set(authority=1)
    stimulus.wait_for(f"{device.authority} == 1", within="50 ms")


@pytest.mark.requirement("SAF-5")
def test_commands_with_a_counter_that_stands_still_are_silence(
    device, granted, stimulus, bus, measure
):
    begin = bus.now
    stimulus.freeze("ActuatorCommand", "500 ms")
    back = hand_back_after(begin, device, stimulus)
    limit = WATCHDOG + 2 * CYCLE + device.delay
    measure("hand-back, frozen commands", back, "ms", at_most=limit, source=device.authority)


@pytest.mark.requirement("SAF-6")
def test_commands_with_a_wrong_crc_are_silence(device, granted, stimulus, bus, measure):
    begin = bus.now
    stimulus.corrupt("ActuatorCommand", "500 ms")
    back = hand_back_after(begin, device, stimulus)
    limit = WATCHDOG + 2 * CYCLE + device.delay
    measure("hand-back, wrong CRC", back, "ms", at_most=limit, source=device.authority)


@pytest.mark.requirement("SAF-7")
def test_the_status_is_protected(device, granted, bus, measure):
    bus.run("1 s")
    faults = bus.faults(device.status)
    measure("faulty status frames", len(faults), at_most=0, source=f"{device.status}.counter")


@pytest.mark.requirement("SAF-8")
def test_a_release_gives_the_throttle_back_at_once(device, granted, stimulus, bus, measure):
    begin = bus.now
    granted.set(authority=0)
    back = hand_back_after(begin, device, stimulus)
    limit = 2 * CYCLE + device.delay
    measure("hand-back after release", back, "ms", at_most=limit, source=device.authority)


@pytest.mark.requirement("SAF-9")
def test_the_status_is_sent_without_gaps(device, granted, bus, measure):
    bus.run("1 s")
    times = bus.times(device.status)
    longest = milliseconds((times[1:] - times[:-1]).max())
    measure("longest gap of the status", longest, "ms", at_most=5, source=device.status)


@pytest.mark.requirement("SAF-10")
def test_the_throttle_is_the_benchs_with_authority_and_the_riders_without(
    device, granted, bus, measure
):
    grip = bus.value("RiderControls.grip", "%")
    granted.ramp("throttle", grip + 2.0, over="50 ms")
    bus.run("300 ms")
    opening = bus.value(device.opening, "%")
    measure("opening, bench", opening - grip, "%", at_least=1.5, at_most=2.5, source=device.opening)
    granted.set(authority=0)
    bus.run("300 ms")
    opening = bus.value(device.opening, "%")
    measure(
        "opening, rider", opening - grip, "%", at_least=-0.5, at_most=0.5, source=device.opening
    )


@pytest.mark.requirement("AVL-1")
def test_single_lost_commands_do_not_end_authority(device, granted, stimulus, bus, measure):
    begin = bus.now
    stimulus.drop("ActuatorCommand", "1 s", chance=0.1)
    bus.run("1 s")
    _, authority = bus.trace(device.authority, since=begin)
    measure("authority, 10 % lost", authority.min(), at_least=1, source=device.authority)
