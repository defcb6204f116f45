"""Run all cases of a study in parallel; finished cases are kept.

Every case is a function of seed and number alone, so the results do not depend on the workers.
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
from slipbench.studies.blind_validation.hidden_cases import store_ground_truth, write_whole
from slipbench.studies.blind_validation.one_case import observe, run_case

JUDGED = (
    "identification/mismatch",
    "studies/blind_validation",
    "identification/signals",
    "plant",
    "protocol",
)
"""Folders whose source determines a result."""
AFTERWARDS = frozenset(
    {
        "page.py",
        "figures.py",
        "score.py",
        "counting.py",
        "posterior.py",
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
"""Files that only distribute the work, or count and show results."""
ELSEWHERE = "systems"
"""Folder for systems other than motorcycles; no hidden case uses it."""
Result = dict[str, Any]


@dataclass(frozen=True)
class Study:
    """Number of cases, seed, folder and workers of a study."""

    cases: int
    seed: int
    folder: Path
    workers: Workers = ALL_PROCESSORS


def run_study(
    study: Study,
    progress: Callable[[int, int], None] = lambda *_: None,
    work: Callable[[int, int], Result] = run_case,
) -> list[Result]:
    """Results of all cases by number; stores the ground truth, then runs the missing cases.

    progress: called with finished and total cases. work: runs a case from seed and number. Raises
    InputError where the folder holds results of another study or of other source code.
    """
    study.folder.mkdir(parents=True, exist_ok=True)
    fingerprint = store_ground_truth(
        [answer(draw_case(study.seed, n)) for n in range(study.cases)], study.folder
    )
    mark = {"answers": fingerprint, "source": source_fingerprint()}
    done = dict(_done(study, mark))
    missing = [n for n in range(study.cases) if n not in done]
    progress(len(done), study.cases)
    if missing:
        jobs = {f"case-{study.seed}-{n}": (study.seed, n) for n in missing}
        for _, result in done_by(study.workers, work, jobs):
            done[result["case"]] = _keep(study, {**mark, **result})
            progress(len(done), study.cases)
    return [done[n] for n in sorted(done)]


def result_path(folder: Path, number: int) -> Path:
    """Path of the result of a case."""
    return folder / "results" / f"case-{number:04d}.json"


def _keep(study: Study, result: Result) -> Result:
    path = result_path(study.folder, result["case"])
    path.parent.mkdir(exist_ok=True)
    write_whole(path, json.dumps(result, indent=1) + "\n")
    return result


def results_so_far(study: Study) -> list[Result]:
    """Existing results, of any version of the source code. Raises InputError where there is none."""
    results = [result for _, result in _done(study, {})]
    if not results:
        raise InputError(
            "no case of the study has a result yet",
            where=str(study.folder),
            remedy="run the same command without --score-only or --observe-again first",
        )
    return results


def _done(study: Study, mark: dict[str, str]) -> Iterator[tuple[int, Result]]:
    """Existing results. Raises InputError where they belong to another study or source code."""
    for number in range(study.cases):
        path = result_path(study.folder, number)
        if not path.exists():
            continue
        result = _read(path, number)
        for key, value in mark.items():
            if result[key] != value:
                raise InputError(
                    f"the folder contains a result of another study or version ({key} differs)",
                    where=str(path),
                    expected=value,
                    found=str(result[key]),
                    remedy="choose another folder with --out: results of two versions cannot be combined",
                )
        yield number, result


def _read(path: Path, number: int) -> Result:
    """Result of a case. Raises InputError where the file holds none."""
    try:
        result = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError):  # no text, no JSON, or nested too deeply
        result = None
    if (
        not isinstance(result, dict)
        or result.get("case") != number
        or not {"answers", "source"} <= result.keys()
    ):
        raise InputError(
            "the file does not hold the result of the case",
            where=str(path),
            expected=f"JSON with case = {number}, answers and source",
            remedy="delete the file and run the same command without --score-only",
        )
    return result


def observe_again(
    study: Study,
    progress: Callable[[int, int], None] = lambda *_: None,
    work: Callable[[int, int], Result] = observe,
) -> list[Result]:
    """Results with the ideal observer recomputed; verdicts are unchanged.

    For corrections of the observer. The field "observed" of each result then holds the fingerprint
    of the source code. progress: called with finished and total cases.
    """
    source = source_fingerprint()
    done = {r["case"]: r for r in results_so_far(study)}
    open_cases = [n for n, r in done.items() if "failed" not in r and r.get("observed") != source]
    progress(len(done) - len(open_cases), len(done))
    jobs = {f"observe-{study.seed}-{n}": (study.seed, n) for n in open_cases}
    for name, observed in done_by(study.workers, work, jobs) if open_cases else ():
        number = int(name.rpartition("-")[2])
        done[number] = _keep(study, _observed(done[number], observed, source))
        open_cases.remove(number)
        progress(len(done) - len(open_cases), len(done))
    return [done[n] for n in sorted(done)]


def _observed(result: Result, observed: Result, source: str) -> Result:
    new = {**result, "ideal": observed["ideal"], "observed": source}
    if "curve" in result and math.isfinite(observed.get("possible", math.nan)):
        new["curve"] = {**result["curve"], "possible": observed["possible"]}
    return new


def source_fingerprint(root: Path = Path(__file__).parents[2]) -> str:
    """Fingerprint of all source code that determines a result."""
    digest = hashlib.sha256()
    for folder in JUDGED:
        for path in sorted((root / folder).rglob("*.py")):
            if path.name not in AFTERWARDS and ELSEWHERE not in path.parts:
                digest.update(path.relative_to(root).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()
