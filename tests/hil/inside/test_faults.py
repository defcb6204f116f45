"""Faults between bench and device, made by the kernel: a device behind a CAN gateway that fails.

The device is on vcan1. The kernel's own gateway passes commands and controls to it,
and its status back. Each fault begins during the excitation. The kernel cannot delay frames of a vcan
(it hands them to local sockets past the queue): delays are tried on the simulated clock.
"""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import pytest

from slipbench.protocol.codec.messages import Authority
from tests.bench.bus.wires import VCAN
from tests.hil.inside import gateway
from tests.hil.inside.gateway import Rule
from tests.hil.inside.ride import LATENESS, WATCHDOG, ride
from tests.socketcan.inside.interfaces import set_interface

BEHIND = "vcan1"
COMMANDS, CONTROLS = Rule(VCAN, BEHIND, 0x010), Rule(VCAN, BEHIND, 0x070)
STATUS = Rule(BEHIND, VCAN, 0x030)
AUTHORITY_LOST = "the throttle body grants NONE"
SILENT = "ThrottleStatus: silent"


@dataclass(frozen=True)
class Fault:
    """What makes the fault, and the trip that ends the trial."""

    name: str
    make: Callable[[], None]
    trip: str


def commands_pass_no_longer(instead: Rule | None = None) -> None:
    gateway.remove(COMMANDS)
    if instead is not None:
        gateway.add(instead)


CORRUPT = Rule(VCAN, BEHIND, 0x010, flipped=bytes.fromhex("0000000400000000"))
STUCK = Rule(VCAN, BEHIND, 0x010, replaced=bytes.fromhex("0011223344556677"))
FAULTS = (
    Fault("commands lost", commands_pass_no_longer, AUTHORITY_LOST),
    Fault("commands corrupt", partial(commands_pass_no_longer, CORRUPT), AUTHORITY_LOST),
    Fault("commands stuck", partial(commands_pass_no_longer, STUCK), AUTHORITY_LOST),
    Fault("off the bus", partial(set_interface, BEHIND, up=False), SILENT),
)


@pytest.fixture
def _through_a_gateway() -> Iterator[None]:
    """A gateway between the two interfaces, without a fault."""
    for rule in (COMMANDS, CONTROLS, STATUS):
        gateway.add(rule)
    yield
    set_interface(BEHIND, up=True)
    gateway.remove_all()


@pytest.mark.usefixtures("_through_a_gateway")
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_the_throttle_is_given_back_and_the_trial_says_why(fault: Fault, tmp_path: Path) -> None:
    struck = []

    def strike(*_: object) -> None:
        struck.append(time.time())
        fault.make()

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
