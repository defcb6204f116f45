"""`make outside`: analyse published benchmarks by their own splits and write docs/outside.md.

    python -m benchmarks.outside.run RECORDINGS [BENCHMARK...]

The test data take part in no analysis: they are simulated once, when everything is decided. Results
stay in build/outside/<benchmark>.json; the page is made from all of them.
"""

import json
import os
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.outside.benchmarks import BENCHMARKS, Benchmark
from benchmarks.outside.error import error_on
from benchmarks.outside.page import page
from benchmarks.real.run import BUILD as REAL
from benchmarks.real.run import DOCS, TRIALS, import_captures
from slipbench.identification.mismatch.analysis import Analysis, accepted, unexplained
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.memo import sentence
from slipbench.identification.mismatch.runs import open_analysis
from slipbench.identification.mismatch.simulation.piece import Piece
from slipbench.identification.mismatch.simulation.system import System

BUILD = Path("build/outside")
PAGE = DOCS / "outside.md"


def main(arguments: list[str]) -> None:
    """Run the requested benchmarks (default: all) and write the page."""
    recordings, requested = Path(arguments[0]), arguments[1:]
    BUILD.mkdir(parents=True, exist_ok=True)
    for benchmark in BENCHMARKS:
        if not requested or benchmark.name in requested:
            runs = (*benchmark.training, *benchmark.held_out, *(t.run for t in benchmark.tests))
            import_captures(recordings, runs)
            result = _result(benchmark)
            path = BUILD / f"{benchmark.name}.json"
            path.write_text(json.dumps(result, indent=1), encoding="utf-8")
    PAGE.write_text(page(dict(_results())), encoding="utf-8")


def _results() -> Iterator[tuple[str, dict[str, Any]]]:
    for benchmark in BENCHMARKS:
        path = BUILD / f"{benchmark.name}.json"
        if path.exists():
            yield benchmark.name, json.loads(path.read_text(encoding="utf-8"))


def _result(benchmark: Benchmark) -> dict[str, Any]:
    file = TRIALS / "models" / f"{benchmark.model}.toml"
    sets = [
        [REAL / "runs" / n for n in names] for names in (benchmark.training, benchmark.held_out)
    ]
    begun, used = time.monotonic(), time.process_time()
    analysis = open_analysis(file, *sets)
    analyse(analysis, say=lambda words: print(f"{benchmark.name}: {words}", flush=True))
    said = sentence(verdict(analysis))
    used, took = time.process_time() - used, time.monotonic() - begun
    return {
        "sentence": said,
        "processor": used,
        "seconds": took,
        "effects": analysis.named.names if analysis.named else [],
        "withdrawn": bool(analysis.named and analysis.named.names and unexplained(analysis)),
        "errors": _errors(benchmark, analysis),
    }


def _errors(benchmark: Benchmark, a: Analysis) -> list[dict[str, Any]]:
    """Errors of every system on every test, in the benchmark's unit."""
    noise = float(np.sqrt(np.mean(np.concatenate(accepted(a).residuals[0]) ** 2)))
    found = []
    for test in benchmark.tests:
        recording = Piece.of(REAL / "runs" / test.run).read()
        for name, system in _systems(a):
            error = error_on(system, recording, benchmark.first, noise)
            rms = benchmark.factor * error.rms
            found.append({"test": test.name, "model": name, "rms": rms, "samples": error.samples})
    return found


def _systems(a: Analysis) -> Iterator[tuple[str, System]]:
    """Yield the models that are compared: as written, calibrated, and with what was identified."""
    assert a.base is not None
    assert a.named is not None
    yield "as written", a.system
    yield "calibrated", _system(a.base)
    if a.named.names:
        yield "with the identified effects", _system(a.named.fit)


def _system(fit: Fit) -> System:
    return fit.model.at(fit.point)


if __name__ == "__main__":
    main(sys.argv[1:] or [os.environ.get("SLIPBENCH_RECORDINGS", "../shared/recordings")])
