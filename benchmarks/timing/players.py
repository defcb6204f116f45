"""Deviation of each frame from its recorded time: replay by slipbench and by python-can."""

import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import can
import numpy as np

from slipbench.bench.replay.replay_process import ReplayOrder, running_replay
from slipbench.protocol.logs import read_log
from slipbench.protocol.logs.candump_line import format_frames
from slipbench.protocol.logs.frame_log import FrameLog
from timing import cyclictest
from timing.quantiles import Row

RATE = 2000.0  # frames/s on average; gaps of an exponential law, none under 130 us (a full bus)
SHORTEST = 130_000  # ns
STARTS = 0.3  # s: cyclictest has begun by then


def drive(seconds: float, seed: int = 11) -> FrameLog:
    """Random log of irregular traffic."""
    from decode import traffic

    from slipbench.dbc import MOTORBIKE
    from slipbench.protocol.database.database import load_database

    log = traffic(load_database(MOTORBIKE), round(seconds * RATE), seed)
    random = np.random.default_rng(seed)
    gaps = SHORTEST + random.exponential(1e9 / RATE - SHORTEST, len(log))
    times = 1_700_000_000_000_000_000 + np.cumsum(gaps).astype(np.int64) // 1000 * 1000
    return FrameLog(**{**vars(log), "time_ns": times})


def slipbench(path: Path, seconds: float) -> list[Row | str]:
    """Replay in the real-time process of slipbench, onto a bus that accepts all frames.

    cyclictest runs in the same seconds: what both suffer is the machine's.
    """
    order = ReplayOrder(path, "virtual", ("nobody",))
    with running_replay(order, speed=1.0, passes=1) as running, ThreadPoolExecutor(1) as beside:
        kernel = beside.submit(cyclictest.measure, max(seconds - 1.0, 1.0))
        time.sleep(STARTS)
        running.begin()
        while (report := running.report(within=1.0)) is None:
            pass
        return [kernel.result(), Row("slipbench replay: sent", report.replayed.of_sent_frames)]


def python_can(path: Path) -> Row:
    """Replay with python-can's player (MessageSync) in a process of its own."""
    done = subprocess.run(
        [sys.executable, "-m", "timing.players", str(path)],
        cwd=Path(__file__).parents[1],
        capture_output=True,
        text=True,
        check=True,
    )
    return Row("python-can player: sent", np.array(done.stdout.split(), np.int64))


def measure(seconds: float) -> list[Row | str]:
    """Lateness of cyclictest, of slipbench and of python-can, for one log."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drive.log"
        path.write_bytes(b"".join(format_frames(drive(seconds))))
        return [*slipbench(path, seconds), python_can(path)]


def _play(path: Path) -> None:
    """Play as `can.player` does; print the absolute deviation of each frame, ns."""
    log = read_log(path).frames
    messages = [
        can.Message(
            timestamp=t * 1e-9, arbitration_id=int(i), data=d[:n].tobytes(), is_extended_id=bool(x)
        )
        for t, i, d, n, x in zip(
            log.time_ns, log.identifier, log.data, log.length, log.extended, strict=True
        )
    ]
    came = np.empty(len(messages), np.int64)
    with can.Bus(interface="virtual", channel="nobody") as bus:
        for row, message in enumerate(can.MessageSync(messages, gap=0.0001)):
            came[row] = time.monotonic_ns()
            bus.send(message)
    off = came - came[0] - (log.time_ns - log.time_ns[0])
    print(" ".join(map(str, np.abs(off).tolist())))


if __name__ == "__main__":
    _play(Path(sys.argv[1]))
