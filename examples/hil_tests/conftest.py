"""Device under test of this suite: which message states its authority, and how late it may do so."""

from dataclasses import dataclass

import pytest

GRIP = 9.0  # %, where the rider holds the throttle


@dataclass(frozen=True)
class DeviceUnderTest:
    """An ECU, or a throttle body, that grants authority over the throttle.

    status   message that states the authority
    opening  signal that states the throttle opening
    delay    ms, longest time from a decision of the device to its status on the bus
    """

    status: str
    opening: str
    delay: float

    @property
    def authority(self) -> str:
        """Signal that states the authority."""
        return f"{self.status}.authority"


def pytest_addoption(parser):
    """Add the options of this suite."""
    parser.addoption("--status", default="EcuStatus", help="EcuStatus or ThrottleStatus")
    parser.addoption("--status-delay", type=float, default=5.0, help="ms, of the status")


@pytest.fixture
def device(request, bus, vehicle, stimulus):
    """The device under test, running on the bus, with the rider's hand on the grip."""
    status = request.config.getoption("--status")
    opening = {"EcuStatus": "throttle_command", "ThrottleStatus": "position"}[status]
    under_test = DeviceUnderTest(
        status, f"{status}.{opening}", request.config.getoption("--status-delay")
    )
    bus.run("50 ms")
    if not bus.times("RiderControls").size:  # no node simulates the rider
        stimulus.cyclic("RiderControls", grip=GRIP)
    stimulus.wait_for(f"{under_test.authority} == 0", within="2 s")
    return under_test


@pytest.fixture
def command(device, stimulus):
    """Commands of the bench, every millisecond, which release authority until a test requests it."""
    return stimulus.cyclic("ActuatorCommand", authority=0, throttle=GRIP)


@pytest.fixture
def granted(device, command, stimulus, bus):
    """Commands of the bench, after the device has granted authority."""
    bus.run("10 ms")
    command.set(authority=1)
    stimulus.wait_for(f"{device.authority} == 1", within="100 ms")
    bus.run("50 ms")
    return command
