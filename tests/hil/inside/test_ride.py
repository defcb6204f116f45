"""A trial rides through the program of the device on a real CAN interface, and a program breaks."""

import signal
import time
from pathlib import Path

import numpy as np

from slipbench.protocol.codec.messages import Authority
from tests.hil.inside.ride import LATENESS, WATCHDOG, ride
from tests.socketcan.inside.programs import cut_power


def test_a_whole_sweep_rides_through_the_device(tmp_path: Path) -> None:
    ridden = ride(tmp_path)
    assert ridden.status == 0, ridden.said + ridden.vehicle_said
    commands = [m.throttle for _, m in ridden.commands()]
    start, end = ridden.commands()[0][0], ridden.commands()[-1][0]
    positions = [m.position for t, m in ridden.statuses() if start < t < end]
    assert 0.7 < np.ptp(positions) / np.ptp(commands) < 1.4
    assert ridden.statuses()[-1][1].authority == Authority.NONE


def test_20_ms_after_the_bench_is_killed_the_throttle_is_the_riders(tmp_path: Path) -> None:
    ridden = ride(tmp_path, lambda trial, _: cut_power(trial))
    silence = ridden.granted_until() - ridden.commands()[-1][0]
    print(f"granted until {1e3 * silence:.1f} ms after the last command")
    assert WATCHDOG - LATENESS < silence < WATCHDOG + LATENESS


def test_a_device_that_dies_ends_trial_and_vehicle_with_their_reasons(tmp_path: Path) -> None:
    struck = []

    def kill(_, device) -> None:
        struck.append(time.time())
        device.kill()

    ridden = ride(tmp_path, kill)
    assert ridden.status == 3, ridden.said
    assert "ThrottleStatus" in ridden.said
    assert ridden.commands()[-1][0] - struck[0] < WATCHDOG + LATENESS
    assert ridden.vehicle_status == 2
    assert "throttle: the real device has fallen silent" in ridden.vehicle_said


def test_a_device_that_stands_still_for_50_ms_trips_and_grants_nothing_after_it(
    tmp_path: Path,
) -> None:
    resumed = []

    def pause(_, device) -> None:
        device.send_signal(signal.SIGSTOP)
        time.sleep(0.050)
        resumed.append(time.time())
        device.send_signal(signal.SIGCONT)

    ridden = ride(tmp_path, pause)
    assert ridden.status == 3, ridden.said
    assert "ThrottleStatus" in ridden.said
    after = [m.authority for t, m in ridden.statuses() if t > resumed[0] + LATENESS]
    assert set(after) == {Authority.NONE}
