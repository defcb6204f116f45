"""How late periodic programs are, side by side in one run: this bench, its peers, the kernel.

`python benchmarks/lateness.py [seconds]`. First nothing but the programs themselves, then with a
decode at 100 % in another process. cyclictest shows what this machine can do in that minute; the
ratios to it and to the peers say more than any figure alone.
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
ALONE, LOADED = "nothing of ours beside it", "decode at 100 % beside it"
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
    print(f"inside the tick, into the ring of the recorder: {costs}")


def senders(title: str, seconds: float) -> None:
    """Print how late 1 kHz senders were."""
    print(f"\n1 kHz, {title}, {seconds:g} s each; {time.strftime('%H:%M:%S')}\n{HEAD}")
    kernel = cyclictest.measure(seconds)
    sent, said = wire.measure("slipbench", seconds)
    peers = [wire.measure(name, seconds)[0] for name in PEERS]
    begun = as_recorded(said)
    for row in (kernel, begun, sent, *peers):
        print(row)
    ratio("slipbench begun / cyclictest woken", begun, kernel)
    for peer in peers:
        ratio("slipbench sent / " + str(peer).split(":")[0] + " sent", sent, peer)


def as_recorded(said: str) -> Row:
    """Read the lateness that our sender printed, as a trial's recording has it."""
    head, _, lateness = said.partition("\n")
    skipped = int(head.split()[1])
    return Row("slipbench: begun", np.array(lateness.split(), np.int64), skipped)


def ratio(title: str, ours: Row | str, theirs: Row | str) -> None:
    """Print the ratio of two p99."""
    if isinstance(ours, Row) and isinstance(theirs, Row):
        print(f"  p99, {title}: {ours.p99 / max(theirs.p99, 1.0):.3f}")


def replays(title: str, seconds: float) -> None:
    """Print how far from their recorded times replayed frames were."""
    print(f"\nreplay, {players.RATE:g} frames/s, {title}\n{HEAD}")
    kernel, ours, theirs = players.measure(seconds)
    for row in (kernel, ours, theirs):
        print(row)
    ratio("slipbench / python-can", ours, theirs)
    ratio("slipbench / cyclictest", ours, kernel)


def triggers(title: str) -> None:
    """Print how long after the button's frame the first command with authority was on the bus."""
    print(f"\nbutton's frame to first frame with authority, {title}\n{HEAD}")
    print(*trigger.measure(), sep="\n")


def accounted() -> None:
    """Print what became of every tick of a minute."""
    row, said = wire.measure("slipbench", ACCOUNTED)
    due, skipped = map(int, said.partition("\n")[0].split())
    ran = as_recorded(said).lateness.size
    heard = row.lateness.size if isinstance(row, Row) else 0
    print(
        f"\nin {ACCOUNTED:g} s with a decode beside it: {due} ticks due, {ran} sent or late, "
        f"{skipped} skipped, {due - ran - skipped} unaccounted; {heard} heard"
    )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS)
