"""Random frame sequences through the real gateway, as many as one likes, from a seed.

`python -m tests.bench.safety.sequences 1000000` draws a million with hypothesis, in batches of ten
thousand with seeds of their own (so that its memory stays small), and prints how they ended.
`make million` does that on every core. It may be stopped, and goes on with the batches that are
missing, as long as nothing that they went through has changed. The result goes into docs/safety.md.
"""

import hashlib
import json
import os
import signal
import sys
import time
from collections import Counter
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from slipbench.bench.loop.realtime_process import signal_on_parent_exit
from tests.bench.safety import document
from tests.bench.safety.world import ending, live, use_binding
from tests.paths import ROOT

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
    seconds: float = 0.0  # of processor time

    def add(self, other: "Tally") -> None:
        self.sequences += other.sequences
        self.ticks += other.ticks
        self.frames += other.frames
        self.held += other.held
        self.seconds += other.seconds
        self.endings += other.endings


def batch(number: int, size: int = BATCH) -> Tally:
    """Live through `size` sequences drawn from seed `number`; raises where one breaks a law.

    Of an odd number: on a database that is drawn from it, through its binding.
    """
    tally = Tally()
    use_binding(number if number % 2 else 0)

    @seed(number)
    @settings(
        max_examples=size,
        database=None,
        deadline=None,
        phases=[Phase.generate, Phase.shrink],
        suppress_health_check=list(HealthCheck),
        report_multiple_bugs=False,
    )
    @given(SCRIPTS)
    def sequence(script: bytes) -> None:
        world = live(script)
        tally.add(
            Tally(1, world.ticks, world.frames, world.judge.commands, Counter([ending(world)]))
        )

    sequence()
    return tally


def kept(folder: Path, number: int, size: int = BATCH) -> Tally:
    """Give the tally of a batch: as an earlier run left it in `folder`, or lived through now."""
    path = folder / f"{number}.json"
    if not path.exists():
        began = time.process_time()
        tally = batch(number, size)
        tally.seconds = time.process_time() - began
        draft = path.with_suffix(".part")
        draft.write_text(json.dumps(vars(tally)), encoding="utf-8")
        draft.replace(path)
    told = json.loads(path.read_text(encoding="utf-8"))
    return Tally(**{**told, "endings": Counter(told["endings"])})


def lived_through() -> str:
    """Fingerprint of all the code of this project that a sequence goes through."""
    files = {
        Path(module.__file__)
        for module in list(sys.modules.values())
        if getattr(module, "__file__", None) and ROOT in Path(str(module.__file__)).parents
    }
    inside = sorted(file for file in files if ".venv" not in file.parts and file != Path(__file__))
    return hashlib.sha256(b"\0".join(file.read_bytes() for file in inside)).hexdigest()[:16]


def run(first: int, sequences: int, workers: int) -> Tally:
    """Live through `sequences`, in batches with the seeds `first`, `first` + 1 and so on."""
    folder = ROOT / "build" / "million" / lived_through()
    folder.mkdir(parents=True, exist_ok=True)
    total = Tally()
    # None of them outlives a kill of this process.
    with ProcessPoolExecutor(
        workers, initializer=signal_on_parent_exit, initargs=(signal.SIGTERM,)
    ) as pool:
        seeds = range(first, first + sequences // BATCH)
        for done in as_completed([pool.submit(kept, folder, number) for number in seeds]):
            total.add(done.result())
            print(f"{total.sequences} sequences", file=sys.stderr, flush=True)
    return total


def lines(total: Tally, first: int) -> list[str]:
    """Tell the result as a page tells it."""
    seeds = f"{first} to {first + total.sequences // BATCH - 1}"
    told = [
        f"{total.sequences:,} sequences (hypothesis, seeds {seeds}), {total.ticks:,} ticks,"
        f" {total.frames:,} frames, {total.held:,} commands with authority; breaches: 0."
        f" It took {total.seconds / 60:.0f} minutes of processor time.",
        "",
        "| ended | sequences |",
        "|---|---|",
    ]
    return told + [f"| {name} | {count:,} |" for name, count in total.endings.most_common()]


def main() -> None:
    """Run what the command line asks for: number of sequences, first seed, workers."""
    processors = len(os.sched_getaffinity(0))  # `taskset` may leave it fewer
    asked = [int(word) for word in sys.argv[1:]] + [MILLION, 1, processors][len(sys.argv) - 1 :]
    number, first, workers = asked
    told = lines(run(first, number, workers), first)
    print("\n".join(told))
    document.write("million", told)


if __name__ == "__main__":
    main()
