"""The report of a session: written from its folder, with `explain` as a process of its own."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the analyses take seconds to import; --help should not
    from slipbench.bench.session.session import Session
    from slipbench.identification.session.day import Day

MEMO, VERDICT = "memo", "verdict.json"
FEWEST = 2  # usable runs: one to learn from, one held out


def write_report(session: "Session", vehicle: Path | None) -> Path:
    """Path of report.html; also writes session.json. vehicle: of the nominal simulation, or None."""
    from slipbench.bench.session.session_folder import write_whole
    from slipbench.identification.session.day import figures, results
    from slipbench.identification.session.page import page

    day = _day(session, vehicle)
    found = results(day)
    write_whole(session.folder / "session.json", json.dumps(figures(day, found), indent=1) + "\n")
    path = session.folder / "report.html"
    write_whole(path, page(day, found))
    return path


def _day(session: "Session", vehicle: Path | None) -> "Day":
    from slipbench.bench.session.session_folder import read_look
    from slipbench.identification.session.day import Day, Run

    runs = tuple(
        Run(run.trial, attempt.path.name, read_look(attempt.path))
        for run in session.runs
        for attempt in session.attempts(run)
    )
    incomplete = sorted(path.name for path in (session.folder / "runs").glob("*-incomplete-*"))
    explained, why_not = (None, "") if vehicle is None else _explained(session, vehicle)
    return Day(
        session.plan.name,
        session.plan.description,
        len(session.runs),
        runs,
        tuple(incomplete),
        explained,
        why_not,
        f"{MEMO}/memo.html" if explained is not None else "",
    )


def _explained(session: "Session", vehicle: Path) -> tuple[dict[str, Any] | None, str]:
    """Content of verdict.json, or None and why there is none.

    The last repeat of each trial that has several is held out, so that each trial is validated.
    """
    from slipbench.bench.session.session import usable_runs

    by_trial = [runs for runs in usable_runs(session).values() if runs]
    training = [run for runs in by_trial for run in (runs[:-1] if len(runs) > 1 else runs)]
    held_out = [runs[-1] for runs in by_trial if len(runs) > 1]
    if len(training) + len(held_out) < FEWEST:
        return None, f"Not analysed: fewer than {FEWEST} runs are usable."
    folder = session.folder / MEMO
    command = [sys.executable, "-m", "slipbench", "explain", *map(str, training)]
    command += ["--vehicle", str(vehicle), "--json", str(folder / VERDICT)]
    command += ["--report", str(folder)]
    command += [part for run in held_out for part in ("--held-out", str(run))]
    done = subprocess.run(command, check=False, env=os.environ.copy())
    if done.returncode or not (folder / VERDICT).exists():
        return None, f"The analysis ended with exit status {done.returncode}; see its messages."
    return dict(json.loads((folder / VERDICT).read_text(encoding="utf-8"))), ""
