"""One sealed case: recorded, analysed as anybody's recordings are, and then judged knowing it."""

import tempfile
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from identification.mismatch.explain import Analysis, analyse, verdict
from identification.mismatch.held_out import errors
from identification.mismatch.runs import open_analysis
from identification.mismatch.verdict import as_tree
from identification.proof.generator.case import Case, draw_case, write_case
from identification.proof.ideal import Ideal, ideal, on_held_out
from protocol.errors import InputError

KEPT = ("mismatch", "location", "effects", "unknown", "equivalents", "not_excited", "held_out",
        "rivals", "curve", "complete")  # fmt: skip


def run_case(seed: int, number: int, keep: Path | None = None) -> dict[str, Any]:
    """Return what came of a case, as data. keep: folder for its recordings, else they are gone."""
    case = draw_case(seed, number)
    with tempfile.TemporaryDirectory(prefix="slipbench-case-") as place:
        folder = (keep or Path(place)) / f"case-{number:04d}"
        clock = time.process_time()
        vehicle, training, held_out = write_case(case, folder)
        made = time.process_time()
        try:
            analysis = analyse(open_analysis(vehicle, training, held_out))
        except InputError as fault:  # the engine refuses recordings that it should take
            return {"case": number, "refused": str(fault)}
    told = as_tree(verdict(analysis))
    analysed = time.process_time()
    seen = _seen(case, analysis)
    return {
        "case": number, "verdict": {key: told[key] for key in KEPT if key in told}, **seen,
        "seconds": {"recording": made - clock, "analysis": analysed - made,
                    "ideal": time.process_time() - analysed},
    }  # fmt: skip


def _seen(case: Case, analysis: Analysis) -> dict[str, Any]:
    """What an ideal observer would see, and by how much the truth improves the held-out runs."""
    assert analysis.base is not None
    found = ideal(case, analysis.base)
    told: dict[str, Any] = {
        "ideal": {"gain": found.gain, "each": list(found.each)},
        "truth": _proven(analysis, found),
    }
    if analysis.free is not None and case.hidden and analysis.held_out is not None:
        told["curve"] = {
            "confirmed": analysis.free.confirmed,
            "possible": on_held_out(case, analysis.base, found, analysis.held_out),
        }
    return told


def _proven(analysis: Analysis, found: Ideal) -> list[dict[str, Any]]:
    """Errors on the held-out runs with the true effects fitted; empty where there are none."""
    if found.fit is None or analysis.held_out is None or analysis.base is None:
        return []
    return [asdict(e) for e in errors(analysis.held_out, analysis.base, found.fit)]
