"""Mutation testing of the code between a file and the wire.

`make mutants`: mutmut (its generator; tests/mutant_plugin.py runs the mutants) changes each file of tests/mutants.toml in every way it knows, one change at a
time, and a test must fail for each. `python -m tests.mutants GROUP ...` runs some groups only.
Fails where a mutant survives that the file does not accept, where one was not tried, where an
accepted change no longer exists, or where a line or branch of the safety gate is not covered.
A full run writes its figures into docs/safety.md.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path
from typing import Any

from mutmut.mutation.file_mutation import mutate_file_contents

from tests.bench.safety import document
from tests.mutant_changes import Change, changes_of, only_wording
from tests.paths import ROOT

KILLED = (1, 3)  # exit codes of pytest: a test failed; pytest itself failed
WORKERS = str(len(os.sched_getaffinity(0)))  # `taskset` may leave it fewer processors
LIST = ROOT / "tests" / "mutants.toml"
WORK = ROOT / "mutants"


def main(names: list[str]) -> None:
    """Run the groups, print and write their figures, and exit with what is wrong."""
    table = tomllib.loads(LIST.read_text(encoding="utf-8"))
    accepted = {
        Change(entry["function"], *change): entry["reason"]
        for entry in table.get("accepted", [])
        for change in entry["changes"]
    }
    rows, seconds, trouble, used = [], {}, [], set[Change]()
    for name in names or table["group"]:
        group, started = table["group"][name], time.monotonic()
        if strict(group):
            trouble += coverage(group["files"], group["tests"])
        codes = run_group(name, group)
        seconds[name] = time.monotonic() - started
        for file in group["files"]:
            found = {
                m: code for m, code in codes.items() if m.rpartition(".")[0] == module_of(file)
            }
            alive = [mutant for mutant, code in found.items() if code not in KILLED]
            changes = changes_of(WORK / name / "src" / "slipbench" / file, alive)
            wording, equivalent, bad = split(changes, found, None if strict(group) else accepted)
            used |= set(equivalent)
            counts = (len(found), len(wording), len(equivalent), len(bad))
            rows.append(f"| `{file}` | {' | '.join(map(str, counts))} |")
            trouble += bad
    if not names:
        trouble += [f"accepted, but not a survivor: {change}" for change in accepted.keys() - used]
    report(rows, seconds, write=not names)
    if trouble:
        sys.exit("\n".join(trouble))


def report(rows: list[str], seconds: dict[str, float], *, write: bool) -> None:
    """Print the table; write it into docs/safety.md. seconds: that each group took."""
    lines = [
        "| file | mutants | wording | equivalent | survivors |",
        "|---|---|---|---|---|",
        *rows,
        "",
        f"It took {sum(seconds.values()) / 60:.1f} minutes on {WORKERS} processors: "
        + ", ".join(f"{name} {taken:.0f} s" for name, taken in seconds.items())
        + ".",
    ]
    print("\n".join(lines))
    if write:
        document.write("mutants", lines)


def strict(group: dict[str, Any]) -> bool:
    """Whether a group is the safety gate: every line covered, no survivor accepted."""
    return bool(group.get("coverage"))


def split(
    changes: dict[str, Change], codes: dict[str, int], accepted: dict[Change, str] | None
) -> tuple[list[Change], list[Change], list[str]]:
    """Survivors: those of an error's wording, accepted ones, and the rest as text."""
    wording, equivalent, bad = [], [], []
    for mutant, change in changes.items():
        if accepted is not None and change in accepted:
            equivalent.append(change)
        elif accepted is not None and codes[mutant] == 0 and only_wording(change):
            wording.append(change)
        else:
            bad.append(f"{mutant}: exit code {codes[mutant]}\n{change}")
    return wording, equivalent, bad


def mutate(folder: Path, files: list[str]) -> list[str]:
    """Write every mutant of each file beside its functions; names of the mutants."""
    mutants = []
    for name in files:
        file = folder / "src" / "slipbench" / name
        made = mutate_file_contents(name, file.read_text(encoding="utf-8"))
        if not made.mutant_names:
            sys.exit(f"{name}: no mutants")
        file.write_text(made.code, encoding="utf-8")
        mutants += [f"{module_of(name)}.{mutant}" for mutant in made.mutant_names]
    return mutants


def module_of(file: str) -> str:
    """Name of the module in a file of the package."""
    return f"slipbench.{file.removesuffix('.py').replace('/', '.')}"


def run_group(name: str, group: dict[str, list[str]]) -> dict[str, int]:
    """Run one group in a folder of its own, from nothing; exit code of each mutant."""
    folder = WORK / name
    shutil.rmtree(folder, ignore_errors=True)
    for entry in ("src", "tests", "pyproject.toml", *group.get("needs", [])):
        copy = shutil.copytree if (ROOT / entry).is_dir() else shutil.copy
        folder.mkdir(parents=True, exist_ok=True)
        copy(ROOT / entry, folder / entry)
    names, slow = folder / "mutants.json", [f"--deselect={it}" for it in group.get("slow", [])]
    names.write_text(json.dumps(mutate(folder, group["files"])), encoding="utf-8")
    options = ["-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "tests.mutant_plugin"]
    options += ["--mutants", str(names), "--mutant-workers", WORKERS]
    run(folder, "pytest", *options, *slow, *group["tests"])
    lines = names.with_suffix(".codes").read_text(encoding="utf-8").splitlines()
    return {mutant: int(code) for mutant, code in map(str.split, lines)}


def coverage(files: list[str], tests: list[str]) -> list[str]:
    """Run the tests of the gate; lines and branches of its files that they miss, as text."""
    names = [f"src/slipbench/{file}" for file in files]
    include = f"--include={','.join([*names, *files])}"
    with tempfile.TemporaryDirectory() as folder:
        data, report = f"--data-file={folder}/data", Path(folder) / "report.json"
        pytest = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests]
        run(ROOT, "coverage", "run", data, "--branch", include, *pytest)
        run(ROOT, "coverage", "json", data, "-q", "-o", str(report))
        measured = json.loads(report.read_text(encoding="utf-8"))["files"]
    # coverage names a file with or without the link of src/slipbench, by its version
    found = {(ROOT / name).resolve(): file["summary"] for name, file in measured.items()}
    summaries = {name: found[(ROOT / name).resolve()] for name in names}
    missed = {
        name: summary["missing_lines"] + summary["missing_branches"]
        for name, summary in summaries.items()
    }
    return [
        f"{name}: {number} lines and branches missed" for name, number in missed.items() if number
    ]


def run(folder: Path, module: str, *arguments: str) -> None:
    """Run a tool of this environment; its output is shown only where it fails."""
    done = subprocess.run(
        [sys.executable, "-m", module, *arguments],
        cwd=folder,
        env=os.environ | {"SLIPBENCH_HYPOTHESIS": "mutants", "PYTHONPATH": str(folder / "src")},
        check=False,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    if done.returncode:
        sys.exit(f"{module} {' '.join(arguments)}:\n{done.stdout[-4000:]}")


if __name__ == "__main__":
    main(sys.argv[1:])
