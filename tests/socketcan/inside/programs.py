"""The programs that meet on the bus, and the trial that they are given."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from slipbench.bench.bus.opening import RECEIVE_BUFFER
from tests.bench.bus.wires import VCAN
from tests.paths import TRIALS, with_full_paths

ON_THE_BUS = ("--interface", "socketcan", "--channel", VCAN)
AMPLITUDE = 0.04  # of the throttle, as in the trial file
SHORTER = {'duration = "30 s"': 'duration = "2 s"', 'start = "0.5 Hz"': 'start = "2 Hz"'}
QUICKER = """
settling = "200 ms"
hand_back = "200 ms"
rider.presses_button_after = "300 ms"
"""
PATIENCE = 30.0  # s


def short_trial(folder: Path) -> Path:
    """Shorten the sweep that everybody is shown first."""
    text = (TRIALS / "throttle_sweep.toml").read_text(encoding="utf-8")
    for old, new in SHORTER.items():
        assert old in text
        text = text.replace(old, new)
    text = text.replace('"../', f'"{TRIALS.parent}/').replace("\n[", f"{QUICKER}\n[", 1)
    path = folder / "short.toml"
    path.write_text(text, encoding="utf-8")
    return path


def slip_trial(folder: Path) -> Path:
    """Shorten the steps under slip control: one up, one down; the teeth are learnt in 2.5 s."""
    text = (TRIALS / "slip_steps_throttle.toml").read_text(encoding="utf-8")
    for old, new in {
        'duration = "8 s"': 'duration = "2 s"',
        'after = "5 s"': 'after = "2.5 s"',
    }.items():
        assert old in text
        text = text.replace(old, new)
    text = with_full_paths(text)
    text = text.replace("\n[", '\nsettling = "200 ms"\nhand_back = "200 ms"\n\n[', 1)
    path = folder / "slip.toml"
    path.write_text(text, encoding="utf-8")
    return path


def slipbench(*arguments: str | Path) -> "subprocess.Popen[str]":
    """Start the one command, in a group of its own; what it says is in its `stdout`."""
    return subprocess.Popen(
        [sys.executable, "-u", "-m", "slipbench", *arguments],
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        start_new_session=True,
    )


def cut_power(program: "subprocess.Popen[str]") -> None:
    """`kill -9` for the command and every process that it started, at once."""
    os.killpg(program.pid, signal.SIGKILL)
    program.wait()


@contextmanager
def candump(log: Path) -> Iterator[None]:
    """Write down all that is on the bus, from before the block until after it.

    The kernel's own room for a listener is some 280 frames, 70 ms of a trial: a witness that had to
    wait longer while the others started would miss frames that the bench heard. With the bench's
    room it does not; and it tells (-d) what it missed, which is then the witness's failure.
    """
    with log.open("wb") as file:
        command = ["candump", "-L", "-d", "-r", str(RECEIVE_BUFFER // 2), VCAN]
        witness = subprocess.Popen(command, stdout=file)
        wait_for_listeners(1)
        try:
            yield
        finally:
            time.sleep(0.2)
            witness.send_signal(signal.SIGINT)
            witness.wait(10)
    missed = [line for line in log.read_text(encoding="ascii").splitlines() if "DROP" in line]
    assert not missed, "\n".join(missed)


def wait_for_listeners(count: int) -> None:
    """Wait until the kernel itself says that `count` sockets hear every frame of the interface."""
    table = Path("/proc/net/can/rcvlist_all")
    deadline = time.monotonic() + PATIENCE
    while table.read_text(encoding="ascii").count(f" {VCAN} ") < count:
        assert time.monotonic() < deadline, table.read_text(encoding="ascii")
        time.sleep(0.01)


def frames(log: Path) -> list[str]:
    """Give the frame of each line of a candump log, without time, bus and direction."""
    return [line.split()[2] for line in log.read_text(encoding="ascii").splitlines()]
