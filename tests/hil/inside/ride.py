"""A trial through the program of the device on a real CAN interface, and what was on the bus.

Vehicle, gateway, device and candump are processes of their own. What the device grants is read from
candump's log.
"""

import signal
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import can

from slipbench import dbc
from slipbench.protocol.codec.codec import Codec
from slipbench.protocol.codec.messages import ActuatorCommand, Authority, ThrottleStatus
from slipbench.protocol.database.database import load_database
from tests.bench.bus.wires import VCAN
from tests.hil.device import program
from tests.hil.inside.programs import running
from tests.socketcan.inside.programs import (
    ON_THE_BUS,
    candump,
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


def ride(folder: Path, strike: Callable[..., None] | None = None, channel: str = VCAN) -> Ridden:
    """Ride through the device; strike(trial, device): happens during the excitation.

    channel: interface of the device, which a gateway of the kernel may join to that of the bench
    """
    built, file, log = program(folder), short_trial(folder), folder / "witness.log"
    with candump(log):
        vehicle = slipbench("vehicle", file, *ON_THE_BUS, "--without", "throttle")
        wait_for_listeners(2)
        with running(built, channel) as device:
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
