"""Arrival times of datagrams by kernel time stamps: one clock for every sender.

A sender's deadlines are not known, only that they are a period apart: its grid is laid through the
datagram that was earliest against it. So a constant delay does not count, for nobody.
"""

import socket
import struct
import subprocess
import sys
from pathlib import Path

import numpy as np

from timing.quantiles import Row, absent

PERIOD = 1_000_000  # ns
TIMESTAMPNS, RCVBUFFORCE = 35, 33  # SO_TIMESTAMPNS, SO_RCVBUFFORCE of Linux
SENDERS = Path(__file__).with_name("senders.py")


def measure(name: str, seconds: float) -> tuple[Row | str, str]:
    """Run a sender; returns its row and what it printed."""
    with listener() as link:
        process = subprocess.Popen(
            [sys.executable, str(SENDERS), name, str(link.getsockname()[1]), str(seconds)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        said, trouble = process.communicate()
        if process.returncode:
            return absent(f"{name}: sent", trouble.strip().splitlines()[-1]), ""
        times, numbers = drained(link)
    ticks = numbers if name == "slipbench" else in_sequence(times)
    row = Row(f"{name}: sent", against_grid(times, ticks), int(ticks[-1]) + 1 - ticks.size)
    return row, said


def listener() -> socket.socket:
    """Socket with kernel time stamps and a buffer for a minute."""
    link = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    link.bind(("127.0.0.1", 0))
    try:
        link.setsockopt(socket.SOL_SOCKET, RCVBUFFORCE, 1 << 28)
    except PermissionError:
        link.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 28)
    link.setsockopt(socket.SOL_SOCKET, TIMESTAMPNS, 1)
    link.setblocking(False)
    return link


def drained(link: socket.socket) -> tuple[np.ndarray, np.ndarray]:
    """Kernel time, ns, and number of each received datagram."""
    times, numbers = [], []
    while True:
        try:
            data, extra, _, _ = link.recvmsg(64, 64)
        except BlockingIOError:
            return np.array(times), np.array(numbers)
        seconds, nanoseconds = struct.unpack("qq", extra[0][2])
        times.append(seconds * 1_000_000_000 + nanoseconds)
        numbers.append(int.from_bytes(data, "little"))


def in_sequence(times: np.ndarray) -> np.ndarray:
    """Tick of each datagram of a sender that does not number them.

    A datagram is the tick after the one before; where a whole period or more passed without one
    and no burst made up for it, ticks were skipped.
    """
    lag = times - np.arange(times.size) * PERIOD
    later_minimum = np.minimum.accumulate(lag[::-1])[::-1]  # what it never comes below again
    lost = np.maximum.accumulate((later_minimum - lag.min()) // PERIOD)
    return np.arange(times.size) + lost


def against_grid(times: np.ndarray, ticks: np.ndarray) -> np.ndarray:
    """Lateness against the grid, ns."""
    lag = times - ticks * PERIOD
    return lag - lag.min()
