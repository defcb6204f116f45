"""All cases of a study, on as many workers as there are; what is done stays done.

Every case is a function of seed and number alone, so that the results do not depend on who worked
it out, or when.
"""

import hashlib
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from slipbench.identification.cluster import ALL_PROCESSORS, Workers, done_by
from slipbench.protocol.errors import InputError
from slipbench.studies.blind_validation.generator.case import answer, draw_case
from slipbench.studies.blind_validation.hidden_cases import seal, write_whole
from slipbench.studies.blind_validation.one_case import observe, run_case

JUDGED = (
    "identification/mismatch",
    "studies/blind_validation",
    "identification/signals",
    "plant",
    "protocol",
)
"""Folders whose text decides a result."""
AFTERWARDS = frozenset(
    {
        "page.py",
        "figures.py",
        "score.py",
        "counting.py",
        "shortfalls.py",
        "publish.py",
        "commands.py",
        "study.py",
        "hidden_cases.py",
        "memo.py",
        "memo_page.py",
        "output.py",
        "pictures.py",
    }
)
"""Files of these names only order the work, or count and show what came of it."""
ELSEWHERE = "systems"
"""Folder of what is no motorcycle; no case of a proof meets it."""
Result = dict[str, Any]


@dataclass(frozen=True)
class Study:
    """What is asked for. scheduler: address of a cluster that is there, else local processes."""

    cases: int
    seed: int
    folder: Path
    workers: Workers = ALL_PROCESSORS


def run_study(
    study: Study,
    told: Callable[[int, int], None] = lambda *_: None,
    work: Callable[[int, int], Result] = run_case,
) -> list[Result]:
    """Seal, then work out every case that is not done yet; returns all results by number.

    told: how many cases are done, of how many. work: what is done with seed and number. Raises
    InputError where the folder holds results of another study or of other source text.
    """
    study.folder.mkdir(parents=True, exist_ok=True)
    sealed = seal([answer(draw_case(study.seed, n)) for n in range(study.cases)], study.folder)
    mark = {"answers": sealed, "source": source_fingerprint()}
    done = dict(_done(study, mark))
    left = [n for n in range(study.cases) if n not in done]
    told(len(done), study.cases)
    if left:
        jobs = {f"case-{study.seed}-{n}": (study.seed, n) for n in left}
        for _, result in done_by(study.workers, work, jobs):
            done[result["case"]] = _keep(study, {**mark, **result})
            told(len(done), study.cases)
    return [done[n] for n in sorted(done)]


def place_of(folder: Path, number: int) -> Path:
    """Where the result of a case lies."""
    return folder / "results" / f"case-{number:04d}.json"


def _keep(study: Study, result: Result) -> Result:
    path = place_of(study.folder, result["case"])
    path.parent.mkdir(exist_ok=True)
    write_whole(path, json.dumps(result, indent=1) + "\n")
    return result


def results_so_far(study: Study) -> list[Result]:
    """Return what is done, whatever source text it was done with."""
    return [result for _, result in _done(study, {})]


def _done(study: Study, mark: dict[str, str]) -> Iterator[tuple[int, Result]]:
    """Results that are there. Raises InputError where they are not of this study and text."""
    for number in range(study.cases):
        path = place_of(study.folder, number)
        if not path.exists():
            continue
        result = json.loads(path.read_text(encoding="utf-8"))
        for key, value in mark.items():
            if result[key] != value:
                raise InputError(
                    f"a result of other {key} lies there",
                    where=str(path),
                    expected=value,
                    found=str(result[key]),
                    remedy="give another folder with --out: results of two versions do not mix",
                )
        yield number, result


def observe_again(
    study: Study,
    told: Callable[[int, int], None] = lambda *_: None,
    work: Callable[[int, int], Result] = observe,
) -> list[Result]:
    """Judge anew what there was to see in every case that is done; verdicts stay as they are.

    For when the judge was wrong, not the analysis. Every result then tells by "observed" with which
    source text. Returns all results.
    """
    source = source_fingerprint()
    done = {r["case"]: r for r in results_so_far(study)}
    left = [n for n, r in done.items() if "failed" not in r and r.get("observed") != source]
    told(len(done) - len(left), len(done))
    jobs = {f"observe-{study.seed}-{n}": (study.seed, n) for n in left}
    for name, seen in done_by(study.workers, work, jobs) if left else ():
        number = int(name.rpartition("-")[2])
        done[number] = _keep(study, _observed(done[number], seen, source))
        left.remove(number)
        told(len(done) - len(left), len(done))
    return [done[n] for n in sorted(done)]


def _observed(result: Result, seen: Result, source: str) -> Result:
    new = {**result, "ideal": seen["ideal"], "observed": source}
    if "curve" in result and math.isfinite(seen.get("possible", math.nan)):
        new["curve"] = {**result["curve"], "possible": seen["possible"]}
    return new


def source_fingerprint(root: Path = Path(__file__).parents[2]) -> str:
    """Fingerprint of all source text that decides a result."""
    digest = hashlib.sha256()
    for folder in JUDGED:
        for path in sorted((root / folder).rglob("*.py")):
            if path.name not in AFTERWARDS and ELSEWHERE not in path.parts:
                digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()
