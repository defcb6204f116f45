"""Tick cost and lateness before and after binding files, measured in turn on one machine.

`python benchmarks/bindings.py [COMMIT [ROUNDS]]` checks COMMIT out beside this checkout (default: the
last one before binding files) and runs the trial of each in turn: on the simulated clock for the
processor time of a tick, in real time for its lateness.
"""

import csv
import os
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import numpy as np
from timing.quantiles import HEAD, Row

ROOT = Path(__file__).parents[1]
BEFORE = "559c8ecfa059"  # the last commit before binding files
TRIAL = Path("examples", "trials", "slip_steps_throttle.toml")


def main(commit: str = BEFORE, rounds: int = 3) -> None:
    """Print the table."""
    print(
        f"load average {os.getloadavg()[0]:.1f} before the run; {TRIAL.stem}, {rounds} rounds each"
    )
    with tempfile.TemporaryDirectory() as folder:
        old = Path(folder) / "before"
        try:
            git("worktree", "add", "--detach", str(old), commit)
        except subprocess.CalledProcessError:
            print(f"not measured: the history of this checkout has no commit {commit}")
            return
        try:
            print(table({"before": old, "after": ROOT}, rounds, Path(folder)))
        finally:
            git("worktree", "remove", "--force", str(old))


def table(checkouts: dict[str, Path], rounds: int, folder: Path) -> str:
    """Quantiles of all rounds; the checkouts take turns, so that they share the load of the machine."""
    cost: dict[str, list[int]] = {name: [] for name in checkouts}
    late: dict[str, list[int]] = {name: [] for name in checkouts}
    ends: dict[str, list[str]] = {name: [] for name in checkouts}
    skipped = dict.fromkeys(checkouts, 0)
    for number in range(rounds):
        for name, checkout in checkouts.items():
            printed = run(checkout, "-m", "timing.tick", str(checkout / TRIAL))
            cost[name] += map(int, printed.split())
            out = folder / f"{name}-{number}"
            run(
                checkout,
                "-m",
                "slipbench",
                "trial",
                str(checkout / TRIAL),
                "--real-time",
                "--out",
                str(out),
            )
            ran, missing = lateness(out / "ticks.csv")
            with (out / "run.toml").open("rb") as file:
                ends[name].append(tomllib.load(file)["outcome"]["trip"])
            late[name] += ran
            skipped[name] += missing
    rows = [HEAD]
    rows += [str(Row(f"{name}: processor time of a tick", np.array(cost[name]))) for name in cost]
    rows += [str(Row(f"{name}: tick start", np.array(late[name]), skipped[name])) for name in late]
    medians = [float(np.median(cost[name])) for name in cost]
    ratio = f"  p50 of the processor time, after / before: {medians[1] / medians[0]:.2f}"
    trips = "; ".join(f"{name} {', '.join(each)}" for name, each in ends.items())
    return "\n".join(
        [*rows, ratio, f"  trips of the trials in real time, which end early: {trips}"]
    )


def lateness(path: Path) -> tuple[list[int], int]:
    """Lateness in ns of each tick that ran, and number of skipped ticks."""
    with path.open(encoding="ascii") as file:
        rows = list(csv.DictReader(file))
    ran = [int(row["lateness_ns"]) for row in rows if row["lateness_ns"]]
    return ran, len(rows) - len(ran)


def run(checkout: Path, *arguments: str) -> str:
    """Output of Python with the slipbench of a checkout."""
    paths = os.pathsep.join([str(checkout / "src"), str(ROOT / "benchmarks")])
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=checkout,
        env={**os.environ, "PYTHONPATH": paths},
        capture_output=True,
        text=True,
        check=False,
    )
    return done.stdout


def git(*arguments: str) -> None:
    """Run git in this checkout. Raises CalledProcessError where it fails."""
    subprocess.run(["git", "-C", str(ROOT), *arguments], check=True, capture_output=True)


if __name__ == "__main__":
    main(*sys.argv[1:2], *map(int, sys.argv[2:3]))
