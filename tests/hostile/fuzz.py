"""Every command with hostile files, options and paths: `python -m tests.hostile.fuzz CASES SEED`.

Each case follows from the seed and its number alone. A failure is printed with the line that makes
it again: `python -m tests.hostile.fuzz CASES SEED --only NUMBER --keep FOLDER`. CASES is the number
after the last case; `--first` begins later, so that a long run can be made in pieces.

The commands that take minutes (explain of a motorcycle, design for given margins, compare, prove,
paper) are ended by Ctrl-C after some seconds of processor time: they read their files before, and an
interrupted analysis has to end well too. explain of a small table and a plain design run to their end.
"""

import argparse
import logging
import os
import resource
import shutil
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from random import Random

from tests.hostile.fuzz_commands import LINES, QUICK, Case, Line, draw
from tests.hostile.fuzz_materials import make_materials
from tests.hostile.fuzz_run import Ended, Running, output, start, step


def warm_up() -> None:
    """Import what the commands import, once: a case then begins at once."""

    import slipbench.bench.replay.replay_process
    import slipbench.bench.trials.run
    import slipbench.identification.closed_loop_simulation.compare
    import slipbench.identification.design.commands
    import slipbench.identification.fleet.fleet
    import slipbench.identification.mismatch.explain
    import slipbench.identification.report.report
    import slipbench.protocol.export
    import slipbench.protocol.logs.decode_file
    import slipbench.protocol.recording.import_log
    import slipbench.studies.blind_validation.study
    import slipbench.studies.paper.paper_command  # noqa: F401

    logging.disable(logging.NOTSET)


def fuzz(
    cases: Iterable[int],
    seed: int,
    folder: Path,
    jobs: int,
    told: Callable[[Ended], None] = lambda _: None,
    lines: list[Line] = LINES,
) -> list[Ended]:
    """Run the cases of these numbers, `jobs` at once; returns how each ended, in their order.

    lines: the valid command lines that the cases are made of; the first cases are these lines.
    """
    materials = folder / "valid"
    if not materials.exists():
        make_materials(materials, command)
    waiting, running, ended = iter(cases), list[Running](), list[Ended]()
    while True:
        for number in _next(waiting, jobs - len(running)):
            running.append(start(_case(number, seed, materials, folder, lines), number))
        if not running:
            return sorted(ended, key=lambda end: end.running.number)
        for one in running[:]:
            if (end := step(one)) is not None:
                running.remove(one)
                ended.append(end)
                told(end)
        time.sleep(0.01)


def _next(numbers: Iterator[int], most: int) -> Iterator[int]:
    return (number for _, number in zip(range(most), numbers, strict=False))


def _case(number: int, seed: int, materials: Path, folder: Path, lines: list[Line]) -> Case:
    place = folder / f"case{number:05d}"
    place.mkdir()
    return draw(number, Random(f"{seed}:{number}"), materials, place, lines)


def command(argv: list[str], folder: Path) -> None:
    """Run one valid command line in a folder; raises RuntimeError unless its status is 0."""
    running = start(Case(argv, Line(" ".join(argv)), folder, {}, ()), -1)
    while (end := step(running)) is None:
        time.sleep(0.01)
    for name in ("stdout", "stderr"):
        output(folder, name).unlink()
    if end.status:
        raise RuntimeError(f"slipbench {' '.join(argv)}: status {end.status}\n{end.stderr}")


def discard(end: Ended) -> None:
    """Remove what a case left."""
    folder = end.running.case.folder
    shutil.rmtree(folder, ignore_errors=True)
    for name in ("stdout", "stderr"):
        output(folder, name).unlink(missing_ok=True)


def in_a_line(end: Ended, seed: int) -> str:
    """Return a failure as one line: how to make it again, what was changed, what is wrong."""
    case = end.running.case
    words = " ".join(word if len(word) < 60 else f"{word[:40]}..." for word in case.argv)
    return (
        f"--only {end.running.number} (seed {seed}): slipbench {words!r};"
        f" {'; '.join(case.changes) or 'unchanged'}: {end.wrong}"
    )


def main() -> int:
    """Run the target from the command line; status 1 if any case failed."""
    parser = argparse.ArgumentParser(prog="python -m tests.hostile.fuzz", description=__doc__)
    parser.add_argument("cases", type=int)
    parser.add_argument("seed", type=int)
    parser.add_argument("--only", type=int, help="only the case of this number")
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument("--quick", action="store_true", help="only commands of a second or less")
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1)
    parser.add_argument("--keep", type=Path, help="folder for the failed cases, kept")
    given = parser.parse_args()
    lines = QUICK if given.quick else LINES
    warm_up()
    print(f"seed {given.seed}, {given.cases} cases, {len(lines)} valid command lines", flush=True)
    folder = given.keep or Path(tempfile.mkdtemp(prefix="fuzz"))
    numbers = range(given.first, given.cases) if given.only is None else [given.only]

    def told(end: Ended) -> None:
        if end.wrong:
            print(in_a_line(end, given.seed), flush=True)
        if given.only is None and not (end.wrong and given.keep):
            discard(end)

    began = time.monotonic()
    ended = fuzz(numbers, given.seed, folder, given.jobs, told, lines)
    if given.keep is None:
        shutil.rmtree(folder, ignore_errors=True)
    print(summary(ended))
    seconds, memory = time.monotonic() - began, max(end.memory for end in ended) >> 20
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    processor = used.ru_utime + used.ru_stime
    print(f"{seconds:.0f} s, {processor:.0f} s of processor, most memory {memory} MB")
    return 1 if any(end.wrong for end in ended) else 0


def summary(ended: list[Ended]) -> str:
    """Return the counts by command and status with the mean duration, and the number of failures."""
    by_name: dict[str, list[Ended]] = defaultdict(list)
    for end in ended:
        by_name[end.running.case.line.argv.split()[0]].append(end)
    lines = []
    for name, ends in sorted(by_name.items()):
        counts = sorted(Counter(end.status for end in ends).items())
        mean = sum(end.seconds for end in ends) / len(ends)
        lines.append(f"  {name:<14}{mean:5.1f} s" + "".join(f"  {s}: {n:<5}" for s, n in counts))
    failed = sum(bool(end.wrong) for end in ended)
    title = "cases by command: mean duration, status: cases"
    return "\n".join([title, *lines, f"{failed} of {len(ended)} failed"])


if __name__ == "__main__":
    sys.exit(main())
