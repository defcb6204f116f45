"""The folder of a session is its state: which runs are recorded, and which were interrupted.

    plan.toml                the plan as it was last given
    trials/NAME-1.toml       trial file of each run
    runs/NAME-1              run folder, complete; runs/NAME-1-attempt-2: the same run once more
    runs/NAME-1-incomplete-1 what was recorded before an interruption
    runs/*/quick_look.json   verdict of the quick look

A run is complete when run.toml has the outcome of a trial that ended, and frames.log reaches it.
Every file is written to a draft, synchronized and renamed, so that a power cut leaves no half file.
"""

import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

from slipbench.protocol.configuration import load_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.logs.candump_line import LINE
from slipbench.protocol.recording.run_folder import DESCRIPTION, FRAMES, ROLES, TRIAL, VEHICLE

QUICK_LOOK = "quick_look.json"
INPUTS_OF_RUN = (TRIAL, VEHICLE, ROLES)
ENDED = ("done", "tripped")
# Trips that are no result of the trial: the operator or the rider did not continue it.
NOT_BEGUN = ("stopped", "never_ready", "never_pressed")
TAIL = 4096  # bytes; longer than any line
SILENCE = 100_000_000  # ns before the end; a bus that falls silent trips a trial sooner


@dataclass(frozen=True)
class Attempt:
    """A run folder: its number as an attempt, and the verdict; "" before its quick look.

    counts  whether the run may be used; amplitude: that is proposed in place of the trial's, or ""
    """

    path: Path
    number: int
    verdict: str = ""
    counts: bool = False
    amplitude: str = ""


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold the folder for this process; the lock ends with it, however it ends.

    Raises InputError where another process has it, or it cannot be made.
    """
    for each in (folder, folder / "trials", folder / "runs"):
        _make(each)
    with (folder / "session.lock").open("w") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as cause:
            raise InputError(
                "another session runs in this folder",
                where=str(folder),
                remedy="end it first, or give another folder with --out",
            ) from cause
        _synchronize(folder.absolute().parent)
        yield


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as cause:
        raise InputError("cannot be made", where=str(folder), found=str(cause)) from cause


def attempts(folder: Path, run: str) -> list[Attempt]:
    """Attempts at a run that are complete, the first one first."""
    found: list[Attempt] = []
    for number in count(1):
        path = attempt_path(folder, run, number)
        if not path.exists():
            return found
        if complete(path):
            look = read_look(path)
            found.append(
                Attempt(
                    path,
                    number,
                    str(look.get("verdict", "")),
                    bool(look.get("counts", False)),
                    str(look.get("proposed_amplitude", "")),
                )
            )
    return found


def attempt_path(folder: Path, run: str, number: int) -> Path:
    """Run folder of an attempt, counted from 1."""
    return folder / "runs" / (run if number == 1 else f"{run}-attempt-{number}")


def complete(run: Path) -> bool:
    """Whether a run folder has a whole recording of a trial that came to its end.

    A quick look is written after all files were synchronized, so it vouches for them.
    """
    if (run / QUICK_LOOK).exists():
        return True
    if not (run / DESCRIPTION).exists() or not all(_intact(name, run) for name in INPUTS_OF_RUN):
        return False
    outcome = load_toml(run / DESCRIPTION).get("outcome", {})
    if outcome.get("phase") not in ENDED or outcome.get("trip") in NOT_BEGUN:
        return False
    ended = max((phase["time_ns"] for phase in outcome.get("phases", [])), default=0)
    return _last_time(run / FRAMES) >= ended - SILENCE


def _intact(name: str, run: Path) -> bool:
    """Whether a copied input reached the disk; a power cut leaves it empty or padded with NUL."""
    path = run / name
    return path.exists() and path.stat().st_size > 0 and b"\0" not in path.read_bytes()


def why_incomplete(run: Path) -> str:
    """Reason why a run folder is not complete, for people."""
    outcome = load_toml(run / DESCRIPTION).get("outcome") if (run / DESCRIPTION).exists() else None
    if outcome is None:
        return "the process ended while it was recorded"
    if outcome.get("trip") in NOT_BEGUN or outcome.get("phase") not in ENDED:
        why = str(outcome.get("detail") or outcome.get("invalid") or outcome.get("trip"))
        return "stopped by the operator" if "KeyboardInterrupt" in why else why
    return f"{FRAMES} or a copied file does not reach the end of the trial"


def set_aside(run: Path) -> Path:
    """Rename an incomplete run folder, so that its number is free; nothing is removed."""
    for number in count(1):
        aside = run.with_name(f"{run.name}-incomplete-{number}")
        if not aside.exists():
            run.rename(aside)
            _synchronize(run.parent)
            return aside
    raise AssertionError


def make_durable(run: Path) -> None:
    """Write every file of a run folder to the disk, so that a power cut does not shorten it."""
    for path in (*run.rglob("*"), run, run.parent):
        _synchronize(path)


def write_look(run: Path, look: Mapping[str, Any]) -> None:
    """Write the quick look of a run, whole or not at all."""
    write_whole(run / QUICK_LOOK, json.dumps(look, indent=1, allow_nan=False) + "\n")


def read_look(run: Path) -> dict[str, Any]:
    """Quick look of a run; empty before it. Raises InputError where it is no JSON."""
    path = run / QUICK_LOOK
    if not path.exists():
        return {}
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except ValueError as cause:
        raise InputError(
            "the quick look cannot be read",
            where=str(path),
            found=str(cause),
            remedy="remove that file: the quick look is taken anew",
        ) from cause


def write_whole(path: Path, text: str) -> None:
    """Write a file, whole or not at all; a power cut afterwards does not lose it."""
    draft = path.with_name(path.name + ".part")
    with draft.open("wb") as file:
        file.write(text.encode("utf-8"))
        file.flush()
        os.fsync(file.fileno())
    draft.replace(path)
    _synchronize(path.parent)


def _synchronize(path: Path) -> None:
    number = os.open(path, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)


def _last_time(log: Path) -> int:
    """Time of the last whole frame, ns; 0 where there is none."""
    if not log.exists():
        return 0
    with log.open("rb") as file:
        file.seek(0, os.SEEK_END)
        file.seek(max(0, file.tell() - TAIL))
        lines = file.read().split(b"\n")[:-1]
    found = LINE.fullmatch(lines[-1]) if lines else None
    if found is None:
        return 0
    return int(found["seconds"]) * 10**9 + int(found["fraction"].ljust(9, b"0"))
