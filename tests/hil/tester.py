"""A tester of the throttle body: it plays bench and rider, and reads what the device reports.

It runs against the device on the simulated clock, or against its program on a real CAN bus
(`tests/hil/inside`); the requirements are the same.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

from slipbench import dbc
from slipbench.protocol.codec.codec import Codec, Sender
from slipbench.protocol.codec.messages import (
    ActuatorCommand,
    Authority,
    RiderControls,
    ThrottleStatus,
)
from slipbench.protocol.database.database import load_database
from tests.hil.device import STATUS_ID, Core

GRIP = 0.10  # opening that the rider asks for
RELEASE = ActuatorCommand(Authority.NONE, 0.0, 0.0, 0.0)
RIDER_EVERY = 5  # ms
Frame = tuple[int, bytes]


class Dut(Protocol):
    """The device under test. jitter: s, of the times at which it and the tester run."""

    jitter: float

    def cycle(self, frames: Sequence[Frame]) -> Sequence[tuple[float, int, bytes]]:
        """Send frames, let a millisecond pass; what was received meanwhile, with its time in s."""

    def now(self) -> float:
        """Time of the tester, s."""

    def jam(self) -> None:
        """Let the plate jam."""

    def stop(self) -> None:
        """Let the device stand still while the bus goes on."""

    def go_on(self) -> None:
        """Let the device continue."""


@dataclass(frozen=True)
class Status:
    """ThrottleStatus as received. time: s, of the tester; message: None where it is not valid."""

    time: float
    counter: int
    message: ThrottleStatus | None


class Tester:
    """Sends commands every millisecond and the rider's controls every 5 ms."""

    __test__ = False  # the name is no test's

    def __init__(self, dut: Dut) -> None:
        self.dut = dut
        self.codec = Codec(load_database(dbc.MOTORBIKE))
        self._sender = Sender(self.codec)
        self._cycles = 0
        self.last_command = 0.0  # s, when the last command was sent

    def run(
        self,
        milliseconds: int,
        command: ActuatorCommand | None = None,
        grip: float | None = GRIP,
        change: Callable[[bytes], bytes] = lambda data: data,
        held: int | None = None,
    ) -> list[Status]:
        """Every status of so many milliseconds.

        command  sent every millisecond; None: silence
        grip     of the rider; None: the rider's controls are silent
        change   applied to the payload of each command
        held     counter of each command; None: it advances
        """
        received: list[Status] = []
        for _ in range(milliseconds):
            frames: list[Frame] = []
            if command is not None:
                timed = replace(command, time=self._cycles * 1e-3)
                identifier, data = self._encode(timed, held)
                frames.append((identifier, change(data)))
                self.last_command = self.dut.now()
            if grip is not None and self._cycles % RIDER_EVERY == 0:
                frames.append(self._encode(RiderControls(False, grip, 0.0, 0.0, 0.0), None))
            self._cycles += 1
            received += [
                self._read(time, data)
                for time, identifier, data in self.dut.cycle(frames)
                if identifier == STATUS_ID
            ]
        return received

    def take(self, command: ActuatorCommand) -> list[Status]:
        """Hold authority with a command, after a release, long enough for the plate to arrive."""
        self.run(20, RELEASE)
        return self.run(300, command)

    def _encode(self, message: ActuatorCommand | RiderControls, held: int | None) -> Frame:
        if held is not None:
            return self.codec.encode(message, counter=held)
        return self._sender.encode(message)

    def _read(self, time: float, data: bytes) -> Status:
        message = self.codec.decode(STATUS_ID, data)
        valid = message if isinstance(message, ThrottleStatus) else None
        return Status(time, data[1] & 0x0F, valid)


class SimulatedDut:
    """The core of the device on a simulated clock; the bus takes no time."""

    jitter = 0.001

    def __init__(self, core: Core) -> None:
        self._core, self._now_us, self._stopped = core, 0, False
        self._waiting: list[Frame] = []

    def cycle(self, frames: Sequence[Frame]) -> Sequence[tuple[float, int, bytes]]:
        self._now_us += 1000
        self._waiting += frames
        if self._stopped:
            return []
        for identifier, data in self._waiting:
            self._core.receive(identifier, data, self._now_us)
        self._waiting.clear()
        payload = self._core.step(self._now_us)
        return [] if payload is None else [(self.now(), STATUS_ID, payload)]

    def now(self) -> float:
        return self._now_us * 1e-6

    def jam(self) -> None:
        self._core.jam()

    def stop(self) -> None:
        self._stopped = True

    def go_on(self) -> None:
        self._stopped = False
