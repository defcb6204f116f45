"""The study: cases in processes, and the page. After an interruption the same command goes on.

python -m benchmarks.designed_trials.run --cases 30 --seed 1 --out docs/designed_trials.md
"""

import argparse
import shutil
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from multiprocessing import get_context
from pathlib import Path

from benchmarks.designed_trials.day import Result, result
from benchmarks.designed_trials.page import page, row


def results(cases: int, seed: int, folder: Path, workers: int) -> Iterator[Result]:
    """Yield results as they come, those that the folder has first."""
    missing = []
    for number in range(cases):
        path = folder / f"{number}.json"
        if path.exists():
            yield Result.read(path.read_text(encoding="utf-8"))
        else:
            missing.append(number)
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        for done in as_completed([pool.submit(_kept, seed, n, folder) for n in missing]):
            yield done.result()


def _kept(seed: int, number: int, folder: Path) -> Result:
    """Result of a case, kept in the folder; its recordings are deleted."""
    place = folder / f"case-{number}"
    shutil.rmtree(place, ignore_errors=True)
    found = result(seed, number, place)
    draft = folder / f"{number}.json.part"
    draft.write_text(found.written(), encoding="utf-8")
    draft.replace(folder / f"{number}.json")
    shutil.rmtree(place)
    return found


def main() -> None:
    """Run the study and write its page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=30)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=Path("build/designed_trials"))
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    folder = given.folder.resolve() / str(given.seed)
    folder.mkdir(parents=True, exist_ok=True)
    found: list[Result] = []
    for one in results(given.cases, given.seed, folder, given.workers):
        found.append(one)
        print(row(one), f"{one.processor:.0f} s", flush=True)
    text = page(sorted(found, key=lambda r: r.number), given.seed)
    if given.out is None:
        print(text)
    else:
        given.out.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
