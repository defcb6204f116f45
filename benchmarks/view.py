"""Lateness of a trial in real time without and with a live view, at 8 000 frames/s.

`python benchmarks/view.py [seconds]`. The virtual motorcycle, the bus, the trial and a sender of
numbered frames are processes of this machine. With the view, a page (a WebSocket client in this
process) receives its updates. Every numbered frame must be in the recording.
"""

import json
import multiprocessing
import os
import re
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import can
import tomli_w
from timing.quantiles import HEAD, Row
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from slipbench.bench.loop.clock import MILLISECOND, MonotonicClock
from slipbench.bench.loop.ticks import TICKS, read_ticks
from slipbench.protocol.configuration import load_toml
from slipbench.protocol.recording.run_folder import FRAMES

SECONDS = 15.0
EXTRA = 4  # frames per burst, of two bytes each
BURST = 1_070_000  # ns: with the motorcycle's 4 300 frames/s about 8 000 frames/s
NUMBERED = 0x6FF
ROOT = Path(__file__).parents[1]
TRIALS = ROOT / "examples" / "trials"
SLIPBENCH = (sys.executable, "-m", "slipbench")


def main(seconds: float = SECONDS) -> None:
    """Print the table."""
    print(f"{os.cpu_count()} processors, load average {os.getloadavg()[0]:.1f} before the run")
    with tempfile.TemporaryDirectory() as folder:
        trial = short_trial(Path(folder), seconds)
        notes = []
        print(f"\n1 kHz trial at 8 000 frames/s, {seconds:g} s of excitation\n{HEAD}")
        for number, view in enumerate((False, True, False, True)):
            run = Path(folder) / f"run-{number}"
            page = ride(trial, run, view)
            name = "with view" if view else "without view"
            print(row(name, run))
            notes.append(f"{name}: {recorded(run)}{page}")
        print("", *notes, sep="\n")


def short_trial(folder: Path, seconds: float) -> Path:
    """Trial file with an excitation of `seconds`."""
    tree = load_toml(TRIALS / "throttle_sweep.toml")
    tree["vehicle"] = str((TRIALS / tree["vehicle"]).resolve())
    tree["excitation"]["duration"] = f"{seconds:g} s"
    path = folder / "trial.toml"
    path.write_text(tomli_w.dumps(tree))
    return path


def ride(trial: Path, run: Path, view: bool) -> str:
    """Run a trial into `run`; what the page received, in words."""
    channel = f"view-{os.getpid()}-{run.name}"
    on = ("--interface", "slipbench", "--channel", channel)
    options = ("--view", "--view-address", "127.0.0.1:0") if view else ()
    vehicle = subprocess.Popen(
        [*SLIPBENCH, "vehicle", str(trial), *on],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    sender = multiprocessing.get_context("spawn").Process(target=send, args=(channel,))
    sender.start()
    with subprocess.Popen(
        [*SLIPBENCH, "trial", str(trial), *on, *options, "--out", str(run)],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    ) as process:
        said = watch(process) if view else ""
        process.communicate()
    sender.terminate()
    vehicle.terminate()
    sender.join()
    vehicle.wait()
    return said


def send(channel: str) -> None:
    """Send numbered frames in bursts until this process is ended."""
    clock, number = MonotonicClock(0), 0
    with can.Bus(interface="slipbench", channel=channel, bitrate=1_000_000) as bus:
        due = clock.now_ns()
        while True:
            for _ in range(EXTRA):
                data = (number & 0xFFFF).to_bytes(2, "big")
                try:
                    bus.send(can.Message(arbitration_id=NUMBERED, data=data, is_extended_id=False))
                except can.CanOperationError:  # the buffer is full: the bus was held up
                    break
                number += 1
            due = max(due + BURST, clock.now_ns() - 20 * MILLISECOND)
            clock.sleep_until_ns(due)


def watch(process: subprocess.Popen[str]) -> str:
    """Receive the updates of a page while the trial runs; their rate in words."""
    address = None
    while address is None:
        address = re.search(r"view: http://(\S+)/", process.stderr.readline())
    times = []
    with (
        connect(f"ws://{address[1]}/live", max_size=None) as page,
        suppress(ConnectionClosed),  # the trial has ended
    ):
        while True:
            message = json.loads(page.recv())
            if message.get("phase") in ("exciting", "settling"):
                times.append(time.monotonic())
    span = times[-1] - times[0]
    gaps = sorted(after - before for before, after in pairwise(times))
    return (
        f"; the page got {(len(times) - 1) / span:.0f} updates/s,"
        f" p99 of the time between two {gaps[int(0.99 * len(gaps))] * 1e3:.0f} ms"
    )


def row(name: str, run: Path) -> Row:
    """Lateness of every tick of a run."""
    lateness = read_ticks(run / TICKS, MILLISECOND)
    return Row(name, lateness.lateness, lateness.skipped)


def recorded(run: Path) -> str:
    """Rate of the recorded frames, and which numbered ones are missing, in words."""
    lines = (run / FRAMES).read_text().splitlines()
    mark = f" {NUMBERED:03X}#"
    numbers = [int(line.split("#")[1][:4], 16) for line in lines if mark in line]
    missing = sum((after - before - 1) & 0xFFFF for before, after in pairwise(numbers))
    first, last = (float(line[1 : line.index(")")]) for line in (lines[0], lines[-1]))
    outcome = load_toml(run / "run.toml")["outcome"]
    return (
        f"{outcome['phase']}, {len(lines) / (last - first):.0f} frames/s,"
        f" {missing} of {len(numbers) + missing} numbered frames missing"
    )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS)
