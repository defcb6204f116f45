"""Faults between bench and device, made by the kernel: a device behind a CAN gateway that fails.

The device is on vcan1. The kernel's own gateway (cangw of can-utils) passes commands and controls to it,
and its status back. Each fault begins during the excitation. The kernel cannot delay frames of a vcan
(it hands them to local sockets past the queue): delays are tried on the simulated clock.
"""

import shlex
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


class Shell:
    """A shell that waits for commands, of the lowest priority.

    To start a program from a large process takes a user-mode kernel longer than the bench waits for the
    simulated rider; the shell is small, and the motorcycle goes before it.
    """

    def __init__(self) -> None:
        self._shell = subprocess.Popen(
            ["nice", "-n", "19", "sh"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def run(self, command: list[str]) -> float:
        """Run a command; returns the time at which it had ended, s."""
        assert self._shell.stdin
        assert self._shell.stdout
        self._shell.stdin.write(f"{shlex.join(command)}; echo $?\n")
        self._shell.stdin.flush()
        assert self._shell.stdout.readline() == "0\n", command
        return time.time()

    def close(self) -> None:
        self._shell.communicate()


@pytest.fixture
def shell() -> Iterator[Shell]:
    """A gateway between the two interfaces, no fault, and a shell that makes one."""
    made = Shell()
    for rule in (COMMANDS, CONTROLS, STATUS):
        made.run(gateway("-A", *rule))
    yield made
    made.run(["ip", "link", "set", BEHIND, "up"])
    made.run(["cangw", "-F"])
    made.close()


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_throttle_is_given_back_and_the_trial_says_why(
    fault: Fault, shell: Shell, tmp_path: Path
) -> None:
    struck = []

    def strike(*_: object) -> None:
        struck.extend(shell.run(command) for command in fault.commands)

    ridden = ride(tmp_path, strike, BEHIND)
    assert ridden.status == 3, ridden.said + ridden.vehicle_said
    assert fault.trip in ridden.said
    asked = ridden.commands()[-1][0] - struck[0]
    granted = ridden.granted_until() - struck[0]
    print(
        f"granted until {1e3 * granted:.1f} ms, asked for until {1e3 * asked:.1f} ms: {fault.name}"
    )
    assert asked < WATCHDOG + 2 * LATENESS
    assert granted < WATCHDOG + 2 * LATENESS
    if fault.trip == AUTHORITY_LOST:  # else no status comes back
        assert ridden.statuses()[-1][1].authority == Authority.NONE
