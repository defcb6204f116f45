"""What an analysis leaves on disk: the verdict, the improved file, the memo."""

import os
from collections.abc import Iterator
from errno import EACCES
from pathlib import Path

import tomli_w

from slipbench.identification.mismatch.analysis import Analysis, accepted
from slipbench.identification.mismatch.telling.improved import improved_system
from slipbench.identification.mismatch.telling.memo_page import memo_page
from slipbench.identification.mismatch.telling.verdict import Verdict, as_json
from slipbench.protocol.errors import InputError
from slipbench.protocol.shipped_files import is_shipped


def prepare_places(json_path: Path | None, folder: Path | None) -> None:
    """Make the folders of what will be written, before the work. Raises InputError where not."""
    try:
        for place in (json_path.parent if json_path else None, folder):
            if place is not None:
                place.mkdir(parents=True, exist_ok=True)
                if not os.access(place, os.W_OK):
                    raise PermissionError(EACCES, os.strerror(EACCES), str(place))
    except OSError as fault:
        raise _refused(fault) from fault


def write_outputs(
    analysis: Analysis, verdict: Verdict, vehicle: Path, json_path: Path | None, folder: Path | None
) -> list[Path]:
    """Write what was asked for. Raises InputError where a place cannot be written."""
    written = []
    try:
        for path, text in _texts(analysis, verdict, vehicle, json_path, folder):
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
            written.append(path)
    except OSError as fault:
        raise _refused(fault) from fault
    return written


def _texts(
    analysis: Analysis, verdict: Verdict, vehicle: Path, json_path: Path | None, folder: Path | None
) -> Iterator[tuple[Path, str]]:
    if json_path is not None:
        yield json_path, as_json(verdict)
    fit = accepted(analysis) if analysis.named else analysis.base
    if fit is not None:
        beside = Path() if is_shipped(vehicle) else vehicle.parent
        path = (folder or beside) / f"{vehicle.stem}.improved.toml"
        yield path, improved_system(fit).text()
    if folder is not None:
        yield folder / "memo.html", memo_page(analysis, verdict)
    if analysis.proposal is not None and folder is not None:
        tree = analysis.system.trial(
            analysis.proposal[1], "next_trial", os.path.relpath(vehicle, folder)
        )
        yield folder / "next_trial.toml", tomli_w.dumps(tree)


def _refused(fault: OSError) -> InputError:
    return InputError(
        "a result cannot be written",
        where=str(fault.filename),
        found=fault.strerror or str(fault),
        remedy="give another place with --json or --report",
    )
