"""The program of the device on a real CAN interface, and the tester's side of that interface."""

import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import can

from tests.bench.bus.wires import VCAN
from tests.hil.tester import Frame

PERIOD = 0.001  # s
BEHIND = 0.005  # s by which the tester may be late; what is later is left out
PATIENCE = 10.0  # s


@contextmanager
def running(program: Path, channel: str = VCAN) -> Iterator["subprocess.Popen[bytes]"]:
    """The device on an interface, from its first frame on."""
    with can.Bus(interface="socketcan", channel=channel) as listener:
        process = subprocess.Popen([program, channel])
        try:
            assert listener.recv(PATIENCE) is not None, "the device sends nothing"
            yield process
        finally:
            process.kill()
            process.wait(PATIENCE)


class ProgramDut:
    """The device as a process. Times in s of the wall clock, as the kernel stamps frames."""

    jitter = 0.010

    def __init__(self, process: "subprocess.Popen[bytes]", bus: can.BusABC) -> None:
        self._process, self._bus = process, bus
        self._due = time.monotonic()

    def cycle(self, frames: Sequence[Frame]) -> Sequence[tuple[float, int, bytes]]:
        for identifier, data in frames:
            message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
            self._bus.send(message)
        self._due = max(self._due + PERIOD, time.monotonic() - BEHIND)
        time.sleep(max(0.0, self._due - time.monotonic()))
        received = []
        while (frame := self._bus.recv(0)) is not None:
            received.append((frame.timestamp, frame.arbitration_id, bytes(frame.data)))
        return received

    def now(self) -> float:
        return time.time()

    def jam(self) -> None:
        self._process.send_signal(signal.SIGUSR1)

    def stop(self) -> None:
        self._process.send_signal(signal.SIGSTOP)

    def go_on(self) -> None:
        self._process.send_signal(signal.SIGCONT)
