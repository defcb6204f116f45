"""Lateness of periodic programs, measured in one run: slipbench, other packages, the kernel.

`python benchmarks/lateness.py [seconds]`. First without other load, then with a decode at
100 % in another process. cyclictest measures the kernel's own wake-up latency at that time; ratios
to it and to the other packages do not depend on the machine as much as the figures do.
"""

import os
import sys
import time
from contextlib import nullcontext

import numpy as np
from timing import cyclictest, players, ring, trigger, wire
from timing.load import decoding
from timing.quantiles import HEAD, Row

SECONDS = 10.0
ACCOUNTED = 60.0  # s of the run in which every tick must be accounted for
ALONE, LOADED = "no other load", "load: decode at 100 %"
PEERS = ("python-can", "hilspy")


def main(seconds: float = SECONDS) -> None:
    """Print the tables."""
    print(f"{os.cpu_count()} processors, load average {os.getloadavg()[0]:.1f} before the run")
    for title, load in ((ALONE, nullcontext), (LOADED, decoding)):
        with load():
            senders(title, seconds)
            replays(title, seconds)
            triggers(title)
    with decoding():
        accounted()
    costs = ", ".join(f"{name} {cost:.2f} us" for name, cost in ring.measure().items())
    print(f"cost of recording within a tick: {costs}")


def senders(title: str, seconds: float) -> None:
    """Print the lateness of 1 kHz senders."""
    print(f"\n1 kHz, {title}, {seconds:g} s each; {time.strftime('%H:%M:%S')}\n{HEAD}")
    kernel = cyclictest.measure(seconds)
    sent, printed = wire.measure("slipbench", seconds)
    peers = [wire.measure(name, seconds)[0] for name in PEERS]
    start = as_recorded(printed)
    for row in (kernel, start, sent, *peers):
        print(row)
    ratio("slipbench tick start / cyclictest wake-up", start, kernel)
    for peer in peers:
        ratio("slipbench sent / " + str(peer).split(":")[0] + " sent", sent, peer)


def as_recorded(printed: str) -> Row:
    """Lateness that the slipbench sender printed, as in the recording of a trial."""
    head, _, lateness = printed.partition("\n")
    skipped = int(head.split()[1])
    return Row("slipbench: tick start", np.array(lateness.split(), np.int64), skipped)


def ratio(title: str, ours: Row | str, theirs: Row | str) -> None:
    """Print the ratio of two 99th percentiles."""
    if isinstance(ours, Row) and isinstance(theirs, Row):
        print(f"  p99, {title}: {ours.p99 / max(theirs.p99, 1.0):.3f}")


def replays(title: str, seconds: float) -> None:
    """Print the deviation of replayed frames from their recorded times."""
    print(f"\nreplay, {players.RATE:g} frames/s, {title}\n{HEAD}")
    kernel, ours, theirs = players.measure(seconds)
    for row in (kernel, ours, theirs):
        print(row)
    ratio("slipbench / python-can", ours, theirs)
    ratio("slipbench / cyclictest", ours, kernel)


def triggers(title: str) -> None:
    """Print the time from the button's frame to the first command with authority on the bus."""
    print(f"\nfrom the button's frame to the first frame with authority, {title}\n{HEAD}")
    print(*trigger.measure(), sep="\n")


def accounted() -> None:
    """Account for every tick of a minute: sent, skipped, received."""
    row, printed = wire.measure("slipbench", ACCOUNTED)
    due, skipped = map(int, printed.partition("\n")[0].split())
    ran = as_recorded(printed).lateness.size
    received = row.lateness.size if isinstance(row, Row) else 0
    print(
        f"\n{ACCOUNTED:g} s, {LOADED}: {due} ticks due, {ran} sent, "
        f"{skipped} skipped, {due - ran - skipped} unaccounted; {received} received"
    )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS)
