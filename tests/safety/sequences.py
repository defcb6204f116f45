"""Random frame sequences through the real gateway, as many as one likes, from a seed.

`python -m tests.safety.sequences 1000000` draws a million with hypothesis, in batches of ten
thousand with seeds of their own (so that its memory stays small), and prints how they ended.
`make million` does that on every core. The result goes into docs/safety.md.
"""

import os
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from tests.safety import document
from tests.safety.world import ending, live

MILLION = 1_000_000
BATCH = 10_000
SCRIPTS = st.binary(min_size=5, max_size=17)


@dataclass
class Tally:
    """What became of the sequences."""

    sequences: int = 0
    ticks: int = 0
    frames: int = 0
    held: int = 0  # commands with authority
    endings: Counter[str] = field(default_factory=Counter)

    def add(self, other: "Tally") -> None:
        self.sequences += other.sequences
        self.ticks += other.ticks
        self.frames += other.frames
        self.held += other.held
        self.endings += other.endings


def batch(number: int, size: int = BATCH) -> Tally:
    """Live through `size` sequences drawn from seed `number`; raises where one breaks a law."""
    tally = Tally()

    @seed(number)
    @settings(
        max_examples=size, database=None, deadline=None, phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck), report_multiple_bugs=False,
    )  # fmt: skip
    @given(SCRIPTS)
    def sequence(script: bytes) -> None:
        world = live(script)
        tally.add(
            Tally(1, world.ticks, world.frames, world.judge.commands, Counter([ending(world)]))
        )

    sequence()
    return tally


def run(first: int, sequences: int, workers: int) -> Tally:
    """Live through `sequences`, in batches with the seeds `first`, `first` + 1 and so on."""
    seeds = range(first, first + sequences // BATCH)
    total = Tally()
    with ProcessPoolExecutor(workers) as pool:
        for tally in pool.map(batch, seeds):
            total.add(tally)
            print(f"{total.sequences} sequences", file=sys.stderr, flush=True)
    return total


def lines(total: Tally, first: int, seconds: float, workers: int) -> list[str]:
    """Tell the result as a page tells it."""
    seeds = f"{first} to {first + total.sequences // BATCH - 1}"
    told = [
        f"{total.sequences:,} sequences (hypothesis, seeds {seeds}), {total.ticks:,} ticks,"
        f" {total.frames:,} frames, {total.held:,} commands with authority; breaches: 0."
        f" It took {seconds / 60:.0f} minutes on {workers} cores.",
        "", "| ended | sequences |", "|---|---|",
    ]  # fmt: skip
    return told + [f"| {name} | {count:,} |" for name, count in total.endings.most_common()]


def main() -> None:
    """Run what the command line asks for: number of sequences, first seed, workers."""
    asked = [int(word) for word in sys.argv[1:]] + [MILLION, 1, os.cpu_count() or 1][
        len(sys.argv) - 1 :
    ]
    number, first, workers = asked
    began = time.monotonic()
    total = run(first, number, workers)
    told = lines(total, first, time.monotonic() - began, workers)
    print("\n".join(told))
    document.write("million", told)


if __name__ == "__main__":
    main()
