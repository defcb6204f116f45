"""Folders of a season for tests: run folders with the files that the index reads, old enough to be kept.

The frames are one line, so no run can be identified; the results are stated, not computed.
"""

import json
import os
from collections.abc import Mapping, Sequence
from itertools import count
from pathlib import Path
from typing import Any

import tomli_w

from tests.paths import TRIALS

FRAME = b"(0000000001.000000) can0 123#00\n"
LONG_AGO = 1_600_000_000_000_000_000  # ns
_tick = count()

MODE = {"frequency": 8.7, "damping": 0.34, "frequency_deviation": 0.1, "damping_deviation": 0.01}
REAL = {"frequency": 18.0, "damping": 1.0, "frequency_deviation": 6.0, "damping_deviation": 0.0}


def write(path: Path, content: bytes | str) -> None:
    """Write a file with a time of change that no file had before."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    age(path)


def age(path: Path) -> None:
    time = LONG_AGO + next(_tick) * 1_000_000
    os.utime(path, ns=(time, time))


def make_run(
    folder: Path,
    day: int = 1,
    tags: Mapping[str, Any] | None = None,
    frequency: float | None = None,
    verdict: str = "good",
) -> Path:
    """A run folder of a throttle sweep. frequency: natural frequency, Hz; None: not identified."""
    run = {"kind": "trial", "name": "sweep", "vehicle": "bike"}
    run["started"] = f"2026-05-{day:02d}T10:00:00+00:00"
    tree = {"run": run, "outcome": {"phase": "done", "trip": "none", "detail": ""}}
    write(folder / "run.toml", tomli_w.dumps({**tree, **({"tags": dict(tags)} if tags else {})}))
    write(folder / "frames.log", FRAME)
    write(folder / "trial.toml", (TRIALS / "throttle_sweep.toml").read_bytes())
    if frequency is not None:
        identify(folder, frequency, verdict)
    return folder


def identify(folder: Path, frequency: float, verdict: str = "good", recording: str = "") -> None:
    """An identification.json with a model of this natural frequency, Hz."""
    model = {
        "input": "throttle_command",
        "output": "slip",
        "poles": [],
        "zeros": [],
        "gain": 1.0,
        "delay": 0.017,
        "delay_interval": [0.013, 0.02],
        "chi_square_ratio": 1.0,
        "freedom": 50,
        "probability": 0.5,
        "adequate": True,
        "drift": [0.0, 1.0],
        "modes": [{**MODE, "frequency": frequency}, REAL],
        "orders": [],
        "words": [],
    }
    tree = {
        "schema_version": "1.0",
        "recording": recording or folder.name,
        "duration": 33.0,
        "verdict": {"word": verdict, "reasons": ["0.5 to 11.9 Hz reliable"]},
        "slip": None,
        "resonance": {"frequency": frequency * 0.9, "peak": 1.8, "low_frequency_gain": 0.15},
        "coherence_min": 0.99,
        "delays": {"input_to_slip": 0.057},
        "models": [model, {**model, "input": "throttle_position", "delay_interval": None}],
        "validations": [],
    }
    write(folder / "identification.json", json.dumps(tree))


def explain(folder: Path, slack: float, half: float = 0.3, training: Sequence[str] = ()) -> None:
    """A verdict.json that has backlash of this slack, with an interval of this half width."""
    effect = {
        "name": "backlash",
        "subject": "",
        "block": "driveline",
        "parameters": [
            {
                "name": "slack",
                "unit": "rad",
                "value": slack,
                "interval": [slack - half, slack + half],
            }
        ],
    }
    tree = {
        "version": 3,
        "mismatch": {"found": True, "p_value": 1e-9},
        "effects": [effect],
        "unknown": {"found": False, "shape": ""},
        "failure": "",
        "training": list(training),
    }
    write(folder / "verdict.json", json.dumps(tree))
