"""The program of the device on a real CAN interface: its requirements, and each planted fault."""

import subprocess
import time
from pathlib import Path

import can
import pytest

from slipbench.protocol.codec.messages import Authority
from tests.bench.bus.wires import VCAN
from tests.hil.device import program
from tests.hil.inside.programs import ProgramDut, running
from tests.hil.requirements import OPEN, PLANTED, REQUIREMENTS, authority, messages
from tests.hil.tester import Tester


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return program(tmp_path_factory.mktemp("device"))


def check(built: Path, requirement: str) -> None:
    with running(built) as process, can.Bus(interface="socketcan", channel=VCAN) as bus:
        REQUIREMENTS[requirement](Tester(ProgramDut(process, bus)))


@pytest.mark.parametrize("requirement", REQUIREMENTS)
def test_the_program_meets_its_requirement(requirement: str, healthy: Path) -> None:
    check(healthy, requirement)


@pytest.mark.parametrize("planted", PLANTED)
def test_a_planted_fault_is_found(planted: str, tmp_path: Path) -> None:
    built = program(tmp_path, planted)
    with pytest.raises(AssertionError):
        check(built, PLANTED[planted])


def test_an_interface_that_was_down_gives_the_throttle_back_until_a_release(healthy: Path) -> None:
    """vcan has no bus-off; for the device an interface that is down is the same silence."""
    with running(healthy) as process:
        with can.Bus(interface="socketcan", channel=VCAN) as bus:
            tester = Tester(ProgramDut(process, bus))
            assert authority(tester.take(OPEN)) == Authority.THROTTLE
        for state in ("down", "up"):
            subprocess.run(["ip", "link", "set", state, "dev", VCAN], check=True)
            time.sleep(0.050)
        with can.Bus(interface="socketcan", channel=VCAN) as bus:
            tester.dut = ProgramDut(process, bus)
            assert {m.authority for m in messages(tester.run(60, OPEN))} == {Authority.NONE}
            assert authority(tester.take(OPEN)) == Authority.THROTTLE
