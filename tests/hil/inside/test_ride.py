"""A trial rides through the program of the device on a real CAN interface, and the device breaks.

Vehicle, gateway, device and candump are processes of their own. What the device grants is read from
candump's log.
"""

import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import can
import numpy as np

from slipbench import dbc
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, ThrottleStatus
from slipbench.protocol.database.database import load_database
from tests.hil.device import program
from tests.hil.inside.programs import running
from tests.socketcan.inside.programs import (
    ON_THE_BUS,
    candump,
    cut_power,
    short_trial,
    slipbench,
    wait_for_listeners,
)

WATCHDOG = 0.020  # s
LATENESS = 0.010  # s by which a cycle of the device, and its frame, may be late
INTO_IT = 0.5  # s of excitation before something happens


@dataclass(frozen=True)
class Ridden:
    """What a trial left behind."""

    status: int
    said: str
    vehicle_status: int
    vehicle_said: str
    witness: Path

    def heard(self) -> Iterator[tuple[float, object]]:
        codec = Codec(load_database(dbc.MOTORBIKE))
        for message in can.LogReader(self.witness):
            yield message.timestamp, codec.decode(message.arbitration_id, message.data)

    def commands(self) -> list[tuple[float, ActuatorCommand]]:
        return [(t, m) for t, m in self.heard() if isinstance(m, ActuatorCommand) and m.authority]

    def statuses(self) -> list[tuple[float, ThrottleStatus]]:
        return [(t, m) for t, m in self.heard() if isinstance(m, ThrottleStatus)]

    def granted_until(self) -> float:
        return max(t for t, m in self.statuses() if m.authority != Authority.NONE)


def ride(folder: Path, strike: Callable[..., None] | None = None) -> Ridden:
    """Ride through the device; strike(trial, device): happens during the excitation."""
    built, file, log = program(folder), short_trial(folder), folder / "witness.log"
    with candump(log):
        vehicle = slipbench("vehicle", file, *ON_THE_BUS, "--without", "throttle")
        wait_for_listeners(2)
        with running(built) as device:
            trial = slipbench("trial", file, *ON_THE_BUS, "--real-time", "--out", folder / "run")
            said = ""
            if strike is not None:
                assert trial.stdout
                for line in trial.stdout:
                    said += line
                    if "exciting" in line:
                        break
                time.sleep(INTO_IT)
                strike(trial, device)
            said += trial.communicate(timeout=60)[0]
            if vehicle.poll() is None:
                time.sleep(0.3)  # a device that has died is reported within this time
        if vehicle.poll() is None:
            vehicle.send_signal(signal.SIGINT)
        vehicle_said, _ = vehicle.communicate(timeout=20)
    return Ridden(trial.returncode, said, vehicle.returncode, vehicle_said, log)


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
