"""Mutation testing of the code between a file and the wire.

`make mutants`: mutmut changes each file of tests/mutants.toml in every way it knows, one change at a
time, and a test must fail for each. `python -m tests.mutants GROUP ...` runs some groups only.
Fails where a mutant survives that the file does not accept, where one was not tried, where an
accepted change no longer exists, or where a line or branch of the safety gate is not covered.
A full run writes its figures into docs/safety.md.

To read a survivor: `cd mutants/GROUP && mutmut show NAME`.
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

from tests.bench.safety import document
from tests.changes import Change, changes_of, only_wording
from tests.paths import ROOT

KILLED = (1, 3)  # exit codes of pytest: a test failed; pytest itself failed
WORKERS = str(len(os.sched_getaffinity(0)))  # `taskset` may leave it fewer processors
LIST = ROOT / "tests" / "mutants.toml"
WORK = ROOT / "mutants"


def main(names: list[str]) -> None:
    """Run the groups, print and write their figures, and exit with what is wrong."""
    began, table = time.monotonic(), tomllib.loads(LIST.read_text(encoding="utf-8"))
    accepted = {
        Change(entry["function"], *change): entry["reason"]
        for entry in table.get("accepted", [])
        for change in entry["changes"]
    }
    rows, trouble, used = [], [], set[Change]()
    for name in names or table["group"]:
        group = table["group"][name]
        if group.get("coverage"):
            trouble += coverage(group["files"], group["tests"])
        run_mutants(name, group)
        for file in group["files"]:
            fates = alive(WORK / name / "mutants" / "src" / "slipbench" / file)
            allowed = {} if group.get("coverage") else accepted
            wording, equivalent, bad = split(fates, allowed)
            used |= set(equivalent)
            rows.append(row(name, file, len(wording), len(equivalent), len(bad)))
            trouble += bad
    if not names:
        trouble += [f"accepted, but not a survivor: {change}" for change in accepted.keys() - used]
    report(rows, began, write=not names)
    if trouble:
        sys.exit("\n".join(trouble))


def report(rows: list[str], began: float, *, write: bool) -> None:
    """Print the table; write it into docs/safety.md."""
    lines = [
        "| file | mutants | wording | equivalent | survivors |",
        "|---|---|---|---|---|",
        *rows,
        "",
        f"It took {(time.monotonic() - began) / 60:.1f} minutes on {WORKERS} processors.",
    ]
    print("\n".join(lines))
    if write:
        document.write("mutants", lines)


def row(group: str, file: str, wording: int, equivalent: int, bad: int) -> str:
    """One row of the table."""
    number = len(fates_of(WORK / group / "mutants" / "src" / "slipbench" / file))
    return f"| `{file}` | {number} | {wording} | {equivalent} | {bad} |"


def split(
    fates: dict[Change, tuple[str, int | None]], accepted: dict[Change, str]
) -> tuple[list[Change], list[Change], list[str]]:
    """Mutants that live: those of an error's wording, accepted ones, and the rest as text.

    Where nothing is accepted, wording is not either.
    """
    wording, equivalent, bad = [], [], []
    for change, (mutant, code) in fates.items():
        if change in accepted:
            equivalent.append(change)
        elif accepted and code == 0 and only_wording(change):
            wording.append(change)
        else:
            bad.append(f"{mutant}: exit code {code}\n{change}")
    return wording, equivalent, bad


def alive(file: Path) -> dict[Change, tuple[str, int | None]]:
    """Mutants of a file that no test killed, those not tried or timed out included."""
    names = {name: code for name, code in fates_of(file).items() if code not in KILLED}
    return {change: (name, names[name]) for name, change in changes_of(file, names).items()}


def fates_of(file: Path) -> dict[str, int | None]:
    """Exit code of the tests, by mutant; exits where the file has no mutants."""
    meta = json.loads(file.with_name(f"{file.name}.meta").read_text(encoding="utf-8"))
    fates: dict[str, int | None] = meta["exit_code_by_key"]
    if not fates:
        sys.exit(f"{file}: no mutants")
    return fates


def run_mutants(name: str, group: dict[str, list[str]]) -> None:
    """Run mutmut on one group in a folder of its own, from nothing."""
    folder = WORK / name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for entry in ROOT.iterdir():
        if not entry.name.startswith(".") and entry.name not in ("mutants", "pyproject.toml"):
            (folder / entry.name).symlink_to(entry)
    files = [f"src/slipbench/{file}" for file in group["files"]]
    slow = [f"--deselect={test}" for test in group.get("slow", [])]
    settings = {
        # mutmut does not follow links while it walks: it gets the folders behind them.
        "source_paths": sorted({"/".join(file.split("/")[:3]) for file in files}),
        "only_mutate": files,
        "also_copy": ["src", "tests", *group.get("needs", [])],
        "pytest_add_cli_args_test_selection": group["tests"],
        "pytest_add_cli_args": ["-p", "no:cacheprovider", "-p", "no:xdist", "-x", *slow],
    }
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    section = "\n".join(f"{key} = {json.dumps(value)}" for key, value in settings.items())
    section += "\ntimeout_constant = 10.0\ntrack_dependencies = false\n"
    (folder / "pyproject.toml").write_text(f"{text}\n[tool.mutmut]\n{section}", encoding="utf-8")
    run(folder, "mutmut", "run", "--max-children", WORKERS)


def coverage(files: list[str], tests: list[str]) -> list[str]:
    """Run the tests of the gate; lines and branches of its files that they miss, as text."""
    names = [f"src/slipbench/{file}" for file in files]
    include = f"--include={','.join(names)}"
    with tempfile.TemporaryDirectory() as folder:
        data, report = f"--data-file={folder}/data", Path(folder) / "report.json"
        pytest = ["-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests]
        run(ROOT, "coverage", "run", data, "--branch", include, *pytest)
        run(ROOT, "coverage", "json", data, "-q", "-o", str(report))
        found = json.loads(report.read_text(encoding="utf-8"))["files"]
    missed = {
        name: found[name]["summary"]["missing_lines"] + found[name]["summary"]["missing_branches"]
        for name in names
    }
    return [
        f"{name}: {number} lines and branches missed" for name, number in missed.items() if number
    ]


def run(folder: Path, module: str, *arguments: str) -> None:
    """Run a tool of this environment; its output is shown only where it fails."""
    done = subprocess.run(
        [sys.executable, "-m", module, *arguments],
        cwd=folder,
        env=os.environ | {"SLIPBENCH_HYPOTHESIS": "mutants"},
        check=False,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    if done.returncode:
        sys.exit(f"{module} {' '.join(arguments)}:\n{done.stdout[-4000:]}")


if __name__ == "__main__":
    main(sys.argv[1:])
