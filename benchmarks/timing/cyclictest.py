"""Reference: wake-up latency of a real-time thread, measured by cyclictest (rt-tests)."""

import re
import subprocess

import numpy as np

from timing.quantiles import Row, absent

NAME = "cyclictest: wake-up"
WIDEST = 50_000  # us that its histogram holds


def measure(seconds: float) -> Row | str:
    """Run cyclictest at 1 kHz, SCHED_FIFO, memory locked."""
    arguments = [
        "-q",
        "-m",
        "-p",
        "80",
        "-i",
        "1000",
        "-l",
        str(round(seconds * 1000)),
        "-h",
        str(WIDEST),
    ]
    try:
        done = subprocess.run(
            ["cyclictest", *arguments], capture_output=True, text=True, timeout=20 * seconds + 20
        )
    except FileNotFoundError:
        return absent(NAME, "cyclictest is not installed; apt-get install rt-tests")
    if done.returncode:
        return absent(NAME, (done.stderr or done.stdout).strip().splitlines()[-1])
    pairs = [
        (int(late), int(count))
        for late, count in re.findall(r"^(\d+)\s+(\d+)$", done.stdout, re.MULTILINE)
    ]
    late = np.repeat([pair[0] for pair in pairs], [pair[1] for pair in pairs]) * 1000
    return Row(NAME, late)
