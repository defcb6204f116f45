"""The study: cases in processes, and the page.

python -m benchmarks.model_files.run --cases 100 --seed 1 --out docs/blind_model_files.md
"""

import argparse
import statistics
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

from benchmarks.model_files.case import TRAINING, Outcome, outcome
from benchmarks.model_files.hidden import VISIBLE
from benchmarks.model_files.simulated import FINER
from benchmarks.model_files.systems import PLANTS
from slipbench.identification.mismatch.systems.model_file import load_model_file

INTRODUCTION = """# Blind validation on other systems

Made by `python -m benchmarks.model_files.run --cases {cases} --seed {seed}`. Every case is a system with a model file
([files](../benchmarks/model_files/systems)): {systems}. The numbers of the simulated plant differ from the file within what it states. In it is
hidden nothing, one effect of the library at a random place with 0.1 to 2 times its typical size, or a wave that no effect of the library
is. What is hidden brings {least:.0f} to {most:.0f} nats to an observer who knows it, once numbers and first
values of states are fitted. `explain` gets {training} recordings
and one held-out recording, with noise, and the whole library ({effects} effects at all places of the systems).

The effects have the formulas of the library; the plant is integrated in {finer} steps a sample, the model as its file says. Effects with
other formulas than the library's are in the [blind validation](blind_validation.md) of the motorcycle and in
[published benchmarks](outside.md).
"""


def page(found: Sequence[Outcome], seed: int) -> str:
    """Return the page."""
    nothing = [o for o in found if o.hidden == "nothing"]
    library = [o for o in found if o.hidden != "nothing" and not o.outside]
    outside = [o for o in found if o.outside]
    systems = ", ".join(load_model_file(p.file).name for p in PLANTS)
    return "\n".join(
        (
            INTRODUCTION.format(
                cases=len(found),
                seed=seed,
                systems=systems,
                least=VISIBLE[0],
                most=VISIBLE[1],
                training=TRAINING,
                effects=_effects(),
                finer=FINER,
            ),
            "| | |",
            "|---|---|",
            f"| nothing hidden: false alarms | {_share(o.alarm for o in nothing)} |",
            f"| effect of the library: alarm | {_share(o.alarm for o in library)} |",
            f"| the name alone, or tied with it | {_share(o.right for o in library)} |",
            f"| the name among those given | {_share(o.hidden in o.named or o.right for o in library)} |",
            f"| 95 % intervals that hold the truth | {_held(library)} |",
            f"| outside of the library: alarm | {_share(o.alarm for o in outside)} |",
            f"| outside: no name of the library | {_share(not o.named for o in outside)} |",
            f"| processor time, median and most | {_seconds(found)} |",
            "",
            "## Cases",
            "",
            "*nats*: of the observer. A name in brackets is listed as equal for these recordings.",
            "",
            "| case | system | hidden | nats | named | s |",
            "|---|---|---|---|---|---|",
            *map(_row, found),
            "",
        )
    )


def _row(o: Outcome) -> str:
    named = ", ".join(o.named) or ("an alarm without a name" if o.alarm else "nothing")
    if o.right and o.named != (o.hidden,):
        named += f" ({o.hidden})"
    nats = f"{o.nats:.0f}" if o.nats else ""
    return f"| {o.number} | {o.plant} | {o.hidden} | {nats} | {named} | {o.seconds:.0f} |"


def _share(which: Iterable[bool]) -> str:
    flags = [*which]
    return f"{sum(flags)} of {len(flags)}"


def _held(found: Iterable[Outcome]) -> str:
    pairs = [(o.inside, o.intervals) for o in found]
    return f"{sum(a for a, _ in pairs)} of {sum(b for _, b in pairs)}"


def _seconds(found: Sequence[Outcome]) -> str:
    times = [o.seconds for o in found]
    return f"{statistics.median(times):.1f} s, {max(times):.0f} s"


def _effects() -> int:
    from slipbench.identification.mismatch.systems.effects.library import LIBRARY

    return len(LIBRARY)


def outcomes(cases: int, seed: int, workers: int) -> Iterator[Outcome]:
    """Yield the outcomes in the order of the cases."""
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(partial(outcome, seed), range(cases))


def main() -> None:
    """Run the study and write its page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=100)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    found: list[Outcome] = []
    for one in outcomes(given.cases, given.seed, given.workers):
        found.append(one)
        print(_row(one), flush=True)
        if given.out is not None:  # what is interrupted keeps its page
            given.out.write_text(page(found, given.seed), encoding="utf-8")
    if given.out is None:
        print(page(found, given.seed))


if __name__ == "__main__":
    main()
