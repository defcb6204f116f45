"""Files of an analysis: the verdict, the improved file, the memo."""

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from errno import EISDIR
from pathlib import Path

import tomli_w

from slipbench.identification.mismatch.analysis import Analysis, accepted, failure_message
from slipbench.identification.mismatch.reporting.improved import improved_system
from slipbench.identification.mismatch.reporting.memo_page import memo_page
from slipbench.identification.mismatch.reporting.open_questions import NAME, open_questions_text
from slipbench.identification.mismatch.reporting.verdict import Verdict, as_json
from slipbench.protocol.errors import InputError
from slipbench.protocol.output_folders import make_folders
from slipbench.protocol.shipped_files import is_shipped

IMPROVED = ".improved.toml"
"""Suffix of the name of the improved file."""


def prepare_places(json_path: Path | None, folder: Path | None) -> None:
    """Make the output folders before the analysis.

    Raises InputError where that fails. Its cause is the OSError: IsADirectoryError where the path
    of the JSON file is a folder.
    """
    try:
        if json_path is not None and json_path.is_dir():
            raise IsADirectoryError(EISDIR, os.strerror(EISDIR), str(json_path))
        folders = (json_path.parent if json_path else None, folder)
        make_folders(*(path for path in folders if path is not None))
    except OSError as error:
        raise _write_error(error) from error


def with_training(verdict: Verdict, runs: Sequence[Path], folder: Path) -> Verdict:
    """Return the verdict with its training runs, as paths relative to the folder."""
    paths = [Path(os.path.relpath(run, folder)).as_posix() for run in runs]
    return replace(verdict, training=tuple(paths))


def write_outputs(
    analysis: Analysis, verdict: Verdict, vehicle: Path, json_path: Path | None, folder: Path | None
) -> list[Path]:
    """Write the requested files; return their paths, verdict.json first.

    If the content of a file cannot be created, `analysis.failure` and verdict.json state it, and
    the other files are written. Raises InputError where a file cannot be written.
    """
    written = []
    for path, text_of in _contents(analysis, verdict, vehicle, json_path, folder):
        try:
            text = text_of()
        except Exception as error:  # write the other files
            analysis.failure = analysis.failure or failure_message(f"writing {path.name}", error)
            continue
        _write(path, text)
        written.append(path)
    if json_path is not None and analysis.failure != verdict.failure:
        _write(json_path, as_json(replace(verdict, complete=False, failure=analysis.failure)))
    return written


def write_improved(analysis: Analysis, path: Path) -> bool:
    """Write the file of the improved system; return whether a fit exists.

    Raises InputError where the file cannot be written.
    """
    fit = accepted(analysis) if analysis.named else analysis.base
    if fit is None:
        return False
    _write(path, improved_system(fit).text())
    return True


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise _write_error(error) from error


def _contents(
    analysis: Analysis, verdict: Verdict, vehicle: Path, json_path: Path | None, folder: Path | None
) -> Iterator[tuple[Path, Callable[[], str]]]:
    if json_path is not None:
        yield json_path, lambda: as_json(verdict)
    fit = accepted(analysis) if analysis.named else analysis.base
    if fit is not None:
        beside = Path() if is_shipped(vehicle) else vehicle.parent
        path = (folder or beside) / f"{vehicle.stem}{IMPROVED}"
        yield path, lambda: improved_system(fit).text()
    if folder is not None:
        yield folder / "memo.html", lambda: memo_page(analysis, verdict)
    if folder is not None and analysis.runs and analysis.named and analysis.system.experiments():
        report_folder = folder
        yield folder / NAME, lambda: open_questions_text(analysis, vehicle, report_folder)
    if analysis.proposal is not None and folder is not None:
        trial, vehicle_path = analysis.proposal[1], os.path.relpath(vehicle, folder)
        yield (
            folder / "next_trial.toml",
            lambda: tomli_w.dumps(analysis.system.trial(trial, "next_trial", vehicle_path)),
        )


def _write_error(error: OSError) -> InputError:
    return InputError(
        "a result cannot be written",
        where=str(error.filename),
        found=error.strerror or str(error),
        remedy="give another place with --json or --report",
    )
