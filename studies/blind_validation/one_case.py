"""One hidden case: generated, analysed as any recording, and compared with the ideal observer."""

import math
import tempfile
import time
import traceback
from dataclasses import asdict
from pathlib import Path
from typing import Any

from slipbench.identification.mismatch.analysis import Analysis
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.fit.held_out import errors, proof
from slipbench.identification.mismatch.runs import open_analysis
from slipbench.identification.mismatch.telling.conclude import verdict
from slipbench.identification.mismatch.telling.verdict import as_tree
from slipbench.studies.blind_validation.generator.case import Case, draw_case, write_case
from slipbench.studies.blind_validation.ideal import Ideal, ideal, on_held_out

KEPT = (
    "mismatch",
    "location",
    "effects",
    "unknown",
    "equivalents",
    "not_excited",
    "held_out",
    "rivals",
    "curve",
    "complete",
)


def run_case(seed: int, number: int, keep: Path | None = None) -> dict[str, Any]:
    """Result of a case as a tree. keep: folder for its recordings; default: they are deleted.

    A case whose analysis raises has the error in "failed" and counts as missed.
    """
    case = draw_case(seed, number)
    with tempfile.TemporaryDirectory(prefix="slipbench-case-") as place:
        folder = (keep or Path(place)) / f"case-{number:04d}"
        started = time.process_time()
        paths = write_case(case, folder)
        recorded = time.process_time()
        try:
            analysis = analyse(open_analysis(*paths))
            tree = as_tree(verdict(analysis))
        except Exception as fault:  # any failure of the analysis is part of the result
            return {
                "case": number,
                "failed": f"{type(fault).__name__}: {fault}",
                "trace": traceback.format_exc(),
            }
    analysed = time.process_time()
    seen = _seen(case, analysis)
    return {
        "case": number,
        "verdict": {key: tree[key] for key in KEPT if key in tree},
        **seen,
        "seconds": {
            "recording": recorded - started,
            "analysis": analysed - recorded,
            "ideal": time.process_time() - analysed,
        },
    }


def observe(seed: int, number: int) -> dict[str, Any]:
    """Ideal observer of a case alone, without an analysis."""
    case = draw_case(seed, number)
    if not case.hidden:
        return {"ideal": _ideal_tree(Ideal(0.0, ()))}
    with tempfile.TemporaryDirectory(prefix="slipbench-case-") as place:
        analysis = open_analysis(*write_case(case, Path(place) / "case"))
    base = calibrate(analysis.training, analysis.training.origin())
    found = ideal(case, base)
    observed: dict[str, Any] = {"ideal": _ideal_tree(found)}
    if analysis.held_out is not None:
        observed["possible"] = on_held_out(case, base, found, analysis.held_out)
    return observed


def _ideal_tree(found: Ideal) -> dict[str, Any]:
    difference = found.difference if math.isfinite(found.difference) else None
    return {"gain": found.gain, "each": list(found.each), "difference": difference}


def _seen(case: Case, analysis: Analysis) -> dict[str, Any]:
    """Gain of the ideal observer, and improvement of the held-out runs by the truth."""
    assert analysis.base is not None
    found = ideal(case, analysis.base)
    observed: dict[str, Any] = {"ideal": _ideal_tree(found), "truth": _proven(analysis, found)}
    if analysis.free is not None and case.hidden and analysis.held_out is not None:
        possible = on_held_out(case, analysis.base, found, analysis.held_out)
        if math.isfinite(possible):
            observed["curve"] = {"confirmed": analysis.free.confirmed, "possible": possible}
    return observed


def _proven(analysis: Analysis, found: Ideal) -> list[dict[str, Any]]:
    """Errors on the held-out runs with the true effects fitted; empty where there are none."""
    if found.fit is None or analysis.held_out is None or analysis.base is None:
        return []
    runs = proof(analysis.held_out, analysis.base, found.fit)
    return [asdict(e) for e in errors(runs)]
