"""`slipbench explain` on a case: recordings as tables, the command, and its verdict."""

import json
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.other_fmus.cases import Case, Signals
from benchmarks.other_fmus.fetch import FMUS, FOLDER

SEEDS = (1, 2)
"""Of the training recording and of the one that is held out."""


def explained(case: Case) -> dict[str, Any]:
    """Record a case, explain it, and return the result."""
    folder = FOLDER / "cases" / case.name
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    source = next(one for one in FMUS if one.name == case.fmu).path
    fmu = folder / source.name
    shutil.copy(source, fmu)
    fmu.with_suffix(".toml").write_text(case.told, encoding="utf-8")
    tables = [folder / f"{name}.csv" for name in ("training", "held_out")]
    for table, seed in zip(tables, SEEDS, strict=True):
        write(table, noisy(case, case.record(fmu, seed), seed))
    begun = time.monotonic()
    words = [sys.executable, "-m", "slipbench", "explain", fmu.name, tables[0].name]
    words += ["--held-out", tables[1].name, "--json", "verdict.json"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, check=False)
    result = {"status": done.returncode, "seconds": time.monotonic() - begun}
    if done.returncode == 2:
        return result | {"problem": done.stderr.strip()}
    return result | _read(case, folder / "verdict.json", done.stdout)


def noisy(case: Case, signals: Signals, seed: int) -> Signals:
    """Return signals with the noise of a case."""
    rng = np.random.default_rng((seed, *case.name.encode()))
    return {
        title: values + case.noise.get(title, 0.0) * rng.standard_normal(values.size)
        for title, values in signals.items()
    }


def write(path: Path, signals: Signals) -> None:
    """Write signals as a table whose titles state the units."""
    rows = np.column_stack([*signals.values()])
    np.savetxt(path, rows, "%.9g", ",", header=",".join(signals), comments="")


def _read(case: Case, path: Path, printed: str) -> dict[str, Any]:
    verdict = json.loads(path.read_text(encoding="utf-8"))
    named = [
        f"{e['name']}.{e['subject']}" if e["subject"] else e["name"] for e in verdict["effects"]
    ]
    return {
        "mismatch": bool((verdict["mismatch"] or {}).get("found")),
        "named": named,
        "tied": verdict["equivalents"],
        "gain": sum(e["gain"] for e in verdict["effects"]),
        "held_out": verdict["held_out"],
        "improvement": verdict["improvement"],
        "sentence": sentence(printed),
        "right": is_right(case, named, verdict),
    }


def is_right(case: Case, named: list[str], verdict: dict[str, Any]) -> bool:
    """Return whether the planted effect is named alone or tied; nothing where none is planted."""
    if not case.right:
        return not (verdict["mismatch"] or {}).get("found")
    tied = [set(names) for names in verdict["equivalents"]]
    meant = {name for names in tied if names & set(named) for name in names} | set(named)
    return len(named) == 1 and bool(meant & set(case.right))


def sentence(printed: str) -> str:
    """Return the verdict of what the command printed: its first paragraph in whole sentences."""
    found = re.search(r"^(?P<said>[A-Z].*\.)$\n\n", printed, re.MULTILINE)
    return found["said"] if found else ""
