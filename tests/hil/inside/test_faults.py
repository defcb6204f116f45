"""Faults between bench and device, made by the kernel: a device behind a CAN gateway that fails.

The device is on vcan1. The kernel's own gateway (cangw of can-utils) passes commands and controls to it,
and its status back. Each fault begins during the excitation. The kernel cannot delay frames of a vcan
(it hands them to local sockets past the queue): delays are tried on the simulated clock.
"""

import subprocess
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from slipbench.protocol.codec.messages import Authority
from tests.bench.bus.wires import VCAN
from tests.hil.inside.ride import LATENESS, WATCHDOG, ride

BEHIND = "vcan1"
COMMANDS = ("-s", VCAN, "-d", BEHIND, "-f", "010:7FF")
CONTROLS = ("-s", VCAN, "-d", BEHIND, "-f", "070:7FF")
STATUS = ("-s", BEHIND, "-d", VCAN, "-f", "030:7FF")
AUTHORITY_LOST = "the throttle body grants NONE"
SILENT = "ThrottleStatus: silent"


def gateway(*rule: str) -> list[str]:
    return ["cangw", *rule, "-e"]  # -e: frames of a socket on this machine as well


@dataclass(frozen=True)
class Fault:
    """Commands that make the fault, and the trip that ends the trial."""

    name: str
    commands: tuple[list[str], ...]
    trip: str


NO_COMMANDS = gateway("-D", *COMMANDS)
FAULTS = (
    Fault("commands lost", (NO_COMMANDS,), AUTHORITY_LOST),
    Fault(
        "commands corrupt",
        (NO_COMMANDS, gateway("-A", *COMMANDS, "-m", "XOR:D:0.8.0000000400000000")),
        AUTHORITY_LOST,
    ),
    Fault(
        "commands stuck",
        (NO_COMMANDS, gateway("-A", *COMMANDS, "-m", "SET:D:0.8.0011223344556677")),
        AUTHORITY_LOST,
    ),
    Fault("off the bus", (["ip", "link", "set", BEHIND, "down"],), SILENT),
)


@pytest.fixture(autouse=True)
def joined() -> Iterator[None]:
    """A gateway between the two interfaces, and no fault."""
    for rule in (COMMANDS, CONTROLS, STATUS):
        run(gateway("-A", *rule))
    yield
    run(["ip", "link", "set", BEHIND, "up"])
    run(["cangw", "-F"])


def run(command: list[str]) -> None:
    subprocess.run(command, check=True)


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_throttle_is_given_back_and_the_trial_says_why(fault: Fault, tmp_path: Path) -> None:
    struck = []

    def strike(*_: object) -> None:
        for command in fault.commands:
            run(command)
            struck.append(time.time())

    ridden = ride(tmp_path, strike, BEHIND)
    assert ridden.status == 3, ridden.said + ridden.vehicle_said
    assert fault.trip in ridden.said
    asked = ridden.commands()[-1][0] - struck[0]
    granted = ridden.granted_until() - struck[0]
    print(
        f"granted until {1e3 * granted:.1f} ms, asked for until {1e3 * asked:.1f} ms after: {fault.name}"
    )
    assert asked < WATCHDOG + 2 * LATENESS
    assert granted < WATCHDOG + 3 * LATENESS
    if fault.trip == AUTHORITY_LOST:  # else no status comes back
        assert ridden.statuses()[-1][1].authority == Authority.NONE
