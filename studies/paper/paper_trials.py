"""Trials for the reproduction, run over CAN where their recordings are missing.

Bench and identification meet only on disk, here too: each trial is a file, and `slipbench trial`, a
program of its own, turns it into a recording.
"""

import subprocess
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tomli_w

from slipbench.protocol.configuration import load_toml, read_toml
from slipbench.protocol.errors import InputError
from slipbench.protocol.recording.recording import Recording
from slipbench.protocol.recording.run_folder import read
from slipbench.protocol.trial_file import TrialFile

TOGETHER = 2  # trials that run at once


@dataclass(frozen=True)
class PaperTrial:
    """An example trial and its changes ("excitation.amplitude": "4 %")."""

    name: str
    base: str
    changes: Mapping[str, Any] = field(default_factory=dict)


def _again(name: str, base: str, runs: int, **changes: Any) -> list[PaperTrial]:
    """The same trial several times with other seeds: other wind, other combustion."""
    changed = {key.replace("__", "."): value for key, value in changes.items()}
    return [PaperTrial(f"{name}_{n}", base, {**changed, "seed": n}) for n in range(1, runs + 1)]


PAPER: tuple[PaperTrial, ...] = (
    *_again("throttle", "throttle_sweep", 2),
    *_again("spark", "spark_sweep", 2),
    *_again("large", "throttle_sweep", 2, excitation__amplitude="5.5 %"),
    *_again("steps", "throttle_steps", 1),
    *_again("sparksteps", "spark_steps", 1, excitation__duration="10 s"),
    *(
        PaperTrial(f"speed_{place}", f"throttle_sweep_{place}", {"excitation.duration": "20 s"})
        for place in ("slow", "12000", "13000", "fast")
    ),
    *(
        PaperTrial(f"multisine_{n}", "throttle_multisine", {"excitation.seed": n, "seed": n})
        for n in (1, 2)
    ),
)


def record_all(
    trials: list[PaperTrial], folder: Path, trial_files: Path, report: Callable[[str], None]
) -> dict[str, Recording]:
    """Recording of every trial, from `folder` where it exists, else simulated.

    Raises InputError where a trial file is invalid, before any trial is run, or a trial trips.
    """
    for trial in trials:
        if not (folder / trial.name).exists():
            _changed(trial, trial_files)
    with ThreadPoolExecutor(TOGETHER) as several:
        recordings = several.map(
            lambda trial: _recorded(trial, folder, trial_files, report), trials
        )
        return dict(zip((trial.name for trial in trials), recordings, strict=True))


def _recorded(
    trial: PaperTrial, folder: Path, trial_files: Path, report: Callable[[str], None]
) -> Recording:
    run = folder / trial.name
    if not run.exists():
        _ride(trial, folder, trial_files)
    report(trial.name)
    return read(run)


def _ride(trial: PaperTrial, folder: Path, trial_files: Path) -> None:
    """Write the trial's file and run it in a process of its own."""
    file = folder / f"{trial.name}.toml"
    text = tomli_w.dumps(_changed(trial, trial_files))
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "slipbench", "trial", str(file)]
    ended = subprocess.run(
        [*command, "--out", str(folder / trial.name)], capture_output=True, text=True, check=False
    )
    if ended.returncode:
        raise InputError(
            f"the trial {trial.name!r} did not come to its end",
            where=str(file),
            found=ended.stderr.strip().removeprefix("slipbench: "),
        )


def _changed(trial: PaperTrial, trial_files: Path) -> dict[str, Any]:
    source = trial_files / f"{trial.base}.toml"
    read_toml(source, TrialFile)
    data = load_toml(source)
    data["name"] = trial.name
    data["vehicle"] = str((source.parent / data["vehicle"]).resolve())
    for path, value in trial.changes.items():
        *tables, key = path.split(".")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        table[key] = value
    return data
