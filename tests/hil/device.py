"""The throttle body in C: built with gcc, as a library for the simulated clock or as a program."""

import ctypes
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can

from slipbench.bench.bus.simulated_bus import SimulatedNode
from tests.paths import ROOT

SOURCES = ROOT / "examples" / "hil"
HARNESS = Path(__file__).with_name("harness.c")
CORE = ("throttle_body.c", "plate.c", "e2e.c")
STATUS_ID = 0x30
MICROSECOND = 1000  # ns


def missing() -> str:
    """What is missing to build the device, and how to get it; empty where nothing is."""
    absent = [program for program in ("gcc", "make") if shutil.which(program) is None]
    return f"apt-get install {' '.join(absent)} libc6-dev" if absent else ""


def program(folder: Path, planted: str = "") -> Path:
    """Build the device for SocketCAN with its own Makefile."""
    command = ["make", "-s", "-B", "-C", SOURCES, "CC=gcc", f"BUILD={folder}", f"PLANTED={planted}"]
    subprocess.run(command, check=True)
    return folder / "throttle_body"


def library(folder: Path, planted: str = "") -> ctypes.CDLL:
    """Build and load the core of the device."""
    path = folder / f"device_{planted.lower()}.so"
    flags = ["-std=gnu11", "-Wall", "-Wextra", "-Werror", "-O2", "-shared", "-fPIC"]
    planting = [f"-DPLANTED_{planted}"] if planted else []
    sources = [HARNESS, *(SOURCES / name for name in CORE)]
    subprocess.run(
        ["gcc", *flags, *planting, f"-I{SOURCES}", "-o", path, *sources, "-lm"], check=True
    )
    loaded = ctypes.CDLL(str(path))
    loaded.device_new.restype = ctypes.c_void_p
    loaded.throttle_body_step.restype = ctypes.c_bool
    return loaded


class Core:
    """One device of a library. Times in us of its own clock."""

    def __init__(self, loaded: ctypes.CDLL) -> None:
        self._library = loaded
        self._body = ctypes.c_void_p(loaded.device_new())

    def receive(self, identifier: int, data: bytes, now_us: int) -> None:
        self._library.throttle_body_receive(
            self._body,
            ctypes.c_uint32(identifier),
            ctypes.c_char_p(data),
            ctypes.c_uint8(len(data)),
            ctypes.c_uint64(now_us),
        )

    def step(self, now_us: int) -> bytes | None:
        """Payload of ThrottleStatus after one cycle; None where none is sent."""
        payload = ctypes.create_string_buffer(8)
        sends = self._library.throttle_body_step(self._body, ctypes.c_uint64(now_us), payload)
        return payload.raw if sends else None

    def jam(self) -> None:
        self._library.device_jam(self._body)


def on_the_bus(
    core: Core, alive: Callable[[int], bool] = lambda _: True
) -> Callable[[SimulatedNode], Callable[[int], None]]:
    """The device on a node of the simulated bus; alive: whether it runs at a time in ns.

    While it does not run, frames wait in its controller, as in a socket.
    """

    def connect(node: SimulatedNode) -> Callable[[int], None]:
        def run_until(time_ns: int) -> None:
            if not alive(time_ns):
                return
            now_us = time_ns // MICROSECOND
            while (frame := node.recv(0)) is not None:
                if not (frame.is_error_frame or frame.is_remote_frame or frame.is_extended_id):
                    core.receive(frame.arbitration_id, bytes(frame.data), now_us)
            if (payload := core.step(now_us)) is not None:
                send(node, payload)

        return run_until

    return connect


def send(node: Any, payload: bytes) -> None:
    """Send ThrottleStatus; a controller that is off the bus or full loses it."""
    message = can.Message(arbitration_id=STATUS_ID, data=payload, is_extended_id=False)
    try:
        node.send(message)
    except can.CanOperationError:
        return
