"""`explain` over the chosen runs of a session, as a process of its own; its folder is memo."""

import hashlib
import json
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # the analyses take seconds to import; --help should not
    from slipbench.bench.session.session import Session
    from slipbench.identification.session.day import Run
    from slipbench.identification.session.selection import Selection

MEMO, VERDICT, INPUT = "memo", "verdict.json", "input.json"
FEWEST = 2  # usable runs: one to learn from, one held out
Say = Callable[[str], None]


def runs_of(session: "Session") -> "tuple[Run, ...]":
    """All complete recordings of a session with their quick looks."""
    from slipbench.bench.session.session_folder import read_look
    from slipbench.identification.session.day import Run

    return tuple(
        Run(run.trial, attempt.path.name, read_look(attempt.path))
        for run in session.runs
        for attempt in session.attempts(run)
    )


def explained(session: "Session", vehicle: Path, say: Say) -> tuple[dict[str, Any] | None, str]:
    """Content of verdict.json, or None and why there is none. vehicle: of the nominal simulation.

    What was analysed already is not analysed again: memo/input.json says of which runs and which
    vehicle the verdict is.
    """
    from slipbench.bench.session.session_folder import write_whole
    from slipbench.identification.session.selection import selection

    chosen = selection(runs_of(session))
    if len(chosen.training) + len(chosen.held_out) < FEWEST:
        return None, f"Not analysed: fewer than {FEWEST} runs are usable."
    folder = session.folder / MEMO
    wanted = _input(chosen, vehicle)
    if _known(folder / INPUT) != wanted or not (folder / VERDICT).exists():
        for line in ("explain:", *(f"  {line}" for line in chosen.lines)):
            say(line)
        (folder / INPUT).unlink(missing_ok=True)
        status = _explain(session, chosen, vehicle)
        if status or not (folder / VERDICT).exists():
            return None, f"The analysis ended with exit status {status}; see its messages."
        write_whole(folder / INPUT, json.dumps(wanted, indent=1) + "\n")
    return dict(json.loads((folder / VERDICT).read_text(encoding="utf-8"))), ""


def _input(chosen: "Selection", vehicle: Path) -> dict[str, Any]:
    return {
        "training": [one.run.name for one in chosen.training],
        "held_out": [one.run.name for one in chosen.held_out],
        "vehicle_sha256": hashlib.sha256(vehicle.read_bytes()).hexdigest(),
    }


def _known(path: Path) -> object:
    """Content of a file that this module wrote, whole or not at all; None where there is none."""
    return json.loads(path.read_text(encoding="utf-8")) if path.exists() else None


def _explain(session: "Session", chosen: "Selection", vehicle: Path) -> int:
    """Exit status of `explain` over these runs."""
    folder, runs = session.folder / MEMO, session.folder / "runs"
    command = [sys.executable, "-m", "slipbench", "explain"]
    command += [str(runs / one.run.name) for one in chosen.training]
    command += ["--vehicle", str(vehicle), "--json", str(folder / VERDICT)]
    command += ["--report", str(folder)]
    for one in chosen.held_out:
        command += ["--held-out", str(runs / one.run.name)]
    return subprocess.run(command, check=False, env=os.environ.copy()).returncode
