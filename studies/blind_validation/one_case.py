"""One hidden case: generated, analysed as any recording, and compared with the ideal observer."""

import tempfile
import time
import traceback
from dataclasses import asdict
from pathlib import Path
from typing import Any

from slipbench.identification.mismatch.analysis import Analysis
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.fit.calibrate import calibrate
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.verdict import as_tree
from slipbench.identification.mismatch.runs import open_analysis
from slipbench.identification.mismatch.simulation.threads import one_thread
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

    A case whose analysis raises has the error in "failed" and counts as missed. A study runs as many
    cases at once as it has processors, so each has one thread.
    """
    with one_thread():
        return _run_case(seed, number, keep)


def _run_case(seed: int, number: int, keep: Path | None) -> dict[str, Any]:
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
    comparison = _comparison(case, analysis)
    return {
        "case": number,
        "verdict": {key: tree[key] for key in KEPT if key in tree},
        **comparison,
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
        return {"ideal": asdict(Ideal(0.0, ()))}
    with tempfile.TemporaryDirectory(prefix="slipbench-case-") as place:
        analysis = open_analysis(*write_case(case, Path(place) / "case"))
    base = calibrate(analysis.training, analysis.training.origin())
    observed: dict[str, Any] = {"ideal": asdict(ideal(case, base))}
    if analysis.held_out is not None:
        observed["possible"] = on_held_out(case, base, analysis.held_out)
    return observed


def _comparison(case: Case, analysis: Analysis) -> dict[str, Any]:
    """Gain of the ideal observer, and share of the free curve in the held-out gain."""
    assert analysis.base is not None
    observed: dict[str, Any] = {"ideal": asdict(ideal(case, analysis.base))}
    if analysis.free is not None and case.hidden and analysis.held_out is not None:
        possible = on_held_out(case, analysis.base, analysis.held_out)
        observed["curve"] = {"confirmed": analysis.free.confirmed, "possible": possible}
    return observed
