"""Every line of the gate is run by its tests, and every change to it makes one of them fail.

`make mutants`: coverage of lines and branches of the safety gate, then mutmut on
it, from nothing. Which files, and with which tests, stands in pyproject.toml. Fails where a line or
a branch is missed, where a mutant lives, or where one was not tried; puts the figures into
docs/safety.md.
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
from tests.paths import ROOT

KILLED = 1  # exit code of a pytest in which a test failed
WORKERS = str(len(os.sched_getaffinity(0)))  # `taskset` may leave it fewer processors


def main() -> None:
    """Measure, tell, write down, and judge."""
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    settings = tomllib.loads(text)["tool"]["mutmut"]
    began = time.monotonic()
    gate: list[str] = settings["only_mutate"]
    covered = coverage(gate, settings["pytest_add_cli_args_test_selection"])
    fates = mutants(gate)
    rows = [
        f"| `{name}` | {covered[name]['num_statements']} | {covered[name]['num_branches']}"
        f" | {missed(covered[name])} | {len(fates[name])} | {len(alive(fates[name]))} |"
        for name in gate
    ]
    head = [
        "| file | statements | branches | missed | mutants | alive |",
        "|---|---|---|---|---|---|",
    ]
    took = f"It took {(time.monotonic() - began) / 60:.1f} minutes on {WORKERS} processors."
    told = [*head, *rows, "", took]
    print("\n".join(told))
    document.write("mutants", told)
    trouble = [f"{name}: {missed(covered[name])} missed" for name in gate if missed(covered[name])]
    trouble += [
        f"{mutant}: exit code {code}" for of in fates.values() for mutant, code in alive(of)
    ]
    trouble += [f"{name}: no mutants" for name in gate if not fates[name]]
    if trouble:
        sys.exit("\n".join(trouble))


def coverage(gate: list[str], tests: list[str]) -> dict[str, dict[str, int]]:
    """Run the gate's tests and count its lines and branches, by file."""
    with tempfile.TemporaryDirectory() as folder:
        data, report = f"--data-file={folder}/data", Path(folder) / "report.json"
        run(
            "coverage",
            "run",
            data,
            "--branch",
            f"--include={','.join(gate)}",
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            *tests,
        )
        run("coverage", "json", data, "-q", "-o", str(report))
        files = json.loads(report.read_text(encoding="utf-8"))["files"]
    return {name: files[name]["summary"] for name in gate}


def missed(summary: dict[str, int]) -> int:
    """Count lines and branches that no test went through."""
    return summary["missing_lines"] + summary["missing_branches"]


def mutants(gate: list[str]) -> dict[str, dict[str, int | None]]:
    """Try every mutant; give the exit code of its tests, by file."""
    shutil.rmtree(ROOT / "mutants", ignore_errors=True)
    run("mutmut", "run", "--max-children", WORKERS)
    fates = {}
    for name in gate:
        told = json.loads((ROOT / "mutants" / f"{name}.meta").read_text(encoding="utf-8"))
        fates[name] = told["exit_code_by_key"]
    return fates


def alive(fates: dict[str, int | None]) -> list[tuple[str, int | None]]:
    """Name the mutants that no test killed, those that were not tried or timed out included."""
    return [(mutant, code) for mutant, code in fates.items() if code != KILLED]


def run(module: str, *arguments: str) -> None:
    """Run a tool of this environment; its words are shown only where it fails."""
    done = subprocess.run(
        [sys.executable, "-m", module, *arguments],
        cwd=ROOT,
        check=False,
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
    )
    if done.returncode:
        sys.exit(f"{module} {' '.join(arguments)}:\n{done.stdout[-4000:]}")


if __name__ == "__main__":
    main()
