"""What an analysis leaves on disk: the verdict, the improved file, the memo."""

import os
from pathlib import Path

import tomli_w

from identification.mismatch.explain import Analysis, accepted
from identification.mismatch.improved import improved_system
from identification.mismatch.memo_page import memo_page
from identification.mismatch.verdict import Verdict, as_json
from protocol.errors import InputError


def write_outputs(
    analysis: Analysis, verdict: Verdict, vehicle: Path, json_path: Path | None, folder: Path | None
) -> list[Path]:
    """Write what was asked for. Raises InputError where a place cannot be written."""
    written = []
    try:
        if json_path is not None:
            json_path.write_text(as_json(verdict), encoding="utf-8")
            written.append(json_path)
        fit = accepted(analysis) if analysis.named else analysis.base
        if fit is not None:
            path = (folder or vehicle.parent) / f"{vehicle.stem}.improved.toml"
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(improved_system(fit).text(), encoding="utf-8")
            written.append(path)
        if folder is not None:
            path = folder / "memo.html"
            folder.mkdir(parents=True, exist_ok=True)
            path.write_text(memo_page(analysis, verdict), encoding="utf-8")
            written.append(path)
        if analysis.proposal is not None and folder is not None:
            path = folder / "next_trial.toml"
            file = os.path.relpath(vehicle, folder)
            tree = analysis.system.trial(analysis.proposal[1], "next_trial", file)
            path.write_text(tomli_w.dumps(tree), encoding="utf-8")
            written.append(path)
    except OSError as fault:
        raise InputError(
            "a result cannot be written",
            where=str(fault.filename),
            found=fault.strerror or str(fault),
            remedy="give another place with --json or --report",
        ) from fault
    return written
