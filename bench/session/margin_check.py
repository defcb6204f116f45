"""A trial run on the simulated clock inside limits that are narrower, before it is offered."""

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w

from slipbench.bench.trials.preparation import prepare
from slipbench.bench.trials.run import run_trial
from slipbench.protocol.configuration import parse
from slipbench.protocol.straight import DRIFT, MARGIN
from slipbench.protocol.trial_file import TrialFile


def trip_of(tree: Mapping[str, Any]) -> str:
    """Why a simulated trial does not come to its end; "" where it does. tree: of its file."""
    with tempfile.TemporaryDirectory() as folder:
        path = written(Path(folder), tree)
        outcome = run_trial(prepare(path), Path(folder) / "run", None)
    return "" if outcome.done else outcome.trip or "it did not end"


def written(folder: Path, tree: Mapping[str, Any]) -> Path:
    """Path of a trial file that was written into a folder."""
    path = folder / "trial.toml"
    path.write_text(tomli_w.dumps(dict(tree)), encoding="utf-8")
    return path


def narrower(tree: Mapping[str, Any]) -> dict[str, Any]:
    """The trial with limits that are narrower by MARGIN, on what the motorcycle does.

    tree: of a trial file. Raises InputError where it is invalid.
    """
    known = parse(dict(tree), TrialFile, where=str(tree.get("name"))).limits
    limits = dict(tree["limits"])
    for name in ("slip", "front_slip"):
        limits[name] = f"{100 * (1 - MARGIN) * getattr(known, name):.6g} %"
    limits["distance"] = f"{known.distance / (1 + DRIFT):.6g} m"
    for name, unit in (("engine_speed", "rad/s"), ("speed", "m/s")):
        low, high = getattr(known, name)
        inset = 0.5 * MARGIN * (high - low)
        limits[name] = [f"{low + inset:.6g} {unit}", f"{high - inset:.6g} {unit}"]
    return {**tree, "limits": limits}
