"""`make real-recordings`: analyse every case with `explain` and write docs/real_recordings.md.

    python -m benchmarks.real.run RECORDINGS [CASE...]

The results of a case stay in build/real/<case>; the page is made from all results there.
"""

import hashlib
import json
import os
import sys
import time
from collections.abc import Iterable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import numpy as np

from benchmarks.real.cases import CAPTURES, CASES, REMARKS, Case
from benchmarks.real.surrogate import surrogate
from slipbench.identification.mismatch.analysis import Analysis, accepted, begin
from slipbench.identification.mismatch.explain import analyse
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.held_out import simulated_only
from slipbench.identification.mismatch.reporting.conclude import verdict
from slipbench.identification.mismatch.reporting.improved import improved_system
from slipbench.identification.mismatch.reporting.memo import sentence
from slipbench.identification.mismatch.reporting.verdict import as_tree
from slipbench.identification.mismatch.runs import open_analysis
from slipbench.identification.mismatch.simulation.model import Model, models
from slipbench.identification.mismatch.simulation.piece import Piece
from slipbench.identification.mismatch.systems.system import ModelSystem
from slipbench.protocol.recording.import_log import Capture as Import
from slipbench.protocol.recording.import_log import import_capture

BUILD, DOCS = Path("build/real"), Path("docs")
TRIALS = Path(__file__).parents[2] / "examples"
MOST = 400
"""Samples shown in a figure."""


def main(arguments: list[str]) -> None:
    """Run the requested cases (default: all) and write the page."""
    recordings, requested = Path(arguments[0]), arguments[1:]
    for case in CASES:
        if not requested or case.name in requested:
            _import(recordings, case)
            _run(case)
            _page()


def _import(recordings: Path, case: Case) -> None:
    import_captures(recordings, (*case.training, *case.held_out, *case.also))


def import_captures(recordings: Path, runs: Iterable[str]) -> None:
    """Import the captures of runs such as name@0:60 that are not in build/real/runs yet."""
    used = {name.partition("@")[0] for name in runs}
    for capture in CAPTURES:
        out = BUILD / "runs" / capture.name
        if capture.name in used and not out.exists():
            out.parent.mkdir(parents=True, exist_ok=True)
            roles = TRIALS / "roles" / f"{capture.roles}.toml"
            database = recordings / capture.database if capture.database else None
            tables = {name: recordings / path for name, path in capture.tables.items()}
            import_capture(Import(recordings / capture.log, roles, database, tables), out)


def _run(case: Case) -> None:
    model = _model(case)
    folders = [[BUILD / "runs" / n for n in names] for names in (case.training, case.held_out)]
    started, used = time.monotonic(), time.process_time()
    analysis = _opened(case, model, *folders)

    def say(words: str) -> None:
        print(f"{time.monotonic() - started:6.1f} s  {case.name}: {words}", flush=True)

    analyse(analysis, say=say)
    result = verdict(analysis)
    tree = as_tree(result)
    tree["sentence"] = sentence(result)
    tree["seconds"] = time.monotonic() - started
    tree["processor"] = time.process_time() - used
    tree["code"] = _code()
    records = (analysis.training.records, analysis.held_out.records if analysis.held_out else ())
    tree["notes"] = [note for part in records for r in part for note in r.notes]
    tree["by_record"] = [*_by_record(analysis, analysis.held_out), *_also(case, analysis)]
    folder = BUILD / case.name
    folder.mkdir(parents=True, exist_ok=True)
    figure = DOCS / "figures" / f"real_{case.name}.png"
    _draw(analysis, figure)
    tree["figure"] = _digest(figure)
    improved = improved_system(accepted(analysis))
    (folder / "improved.toml").write_text(improved.text(), encoding="utf-8")
    (folder / "verdict.json").write_text(json.dumps(tree, indent=1), encoding="utf-8")


def _opened(case: Case, file: Path, *sets: list[Path]) -> Analysis:
    """Analysis of the recordings, or of their surrogates in which nothing is missing."""
    if not case.surrogate:
        return open_analysis(file, *sets)
    system, seeds = ModelSystem.load(file), count(1)
    return begin(
        system,
        *(
            [
                system.prepare(surrogate(system, Piece.of(path).read(), next(seeds)))
                for path in paths
            ]
            for paths in sets
        ),
    )


def _fits(a: Analysis, model: Model) -> Iterator[Fit]:
    """Fits of the nominal, the calibrated and the improved model, driven by the recordings."""
    assert a.base is not None
    assert a.named is not None
    last = a.named.fit
    for system in (a.system, a.base.model.at(a.base.point), last.model.at(last.point)):
        yield simulated_only(model, system, last)


def _also(case: Case, a: Analysis) -> list[dict[str, object]]:
    """Errors on recordings that the analysis did not use, not even for validation."""
    if not case.also:
        return []
    records = [a.system.prepare(Piece.of(BUILD / "runs" / n).read()) for n in case.also]
    return _by_record(a, models(a.system, a.training.records, records)[1])


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.exists() else ""


def _model(case: Case) -> Path:
    if case.model.startswith("improved/"):
        return BUILD / Path(case.model).name / "improved.toml"
    return TRIALS / "models" / f"{case.model}.toml"


def _code() -> str:
    """Fingerprint of the analysis code and the model files: 8 hex digits of SHA-256."""
    root = TRIALS.parent
    sources = [*(root / "identification/mismatch").rglob("*.py"), *(TRIALS / "models").glob("*")]
    digest = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(sources)))
    return digest.hexdigest()[:8]


def _by_record(a: Analysis, model: Model | None) -> list[dict[str, object]]:
    assert model is not None
    found: list[dict[str, object]] = []
    fits = list(_fits(a, model))
    for b, block in enumerate(model.partition.groups):
        for r, record in enumerate(model.records):
            errors = [float(np.sqrt(np.mean(fit.residuals[b][r] ** 2))) for fit in fits]
            found.append({"record": record.name, "output": block.name, "errors": errors})
    return found


def _draw(a: Analysis, path: Path) -> None:
    assert a.held_out is not None
    record, fits = a.held_out.records[0], list(_fits(a, a.held_out))
    block = a.held_out.partition.groups[0]
    unit = record.sensors[block.outputs[0]].unit
    shown = slice(0, min(MOST, record.grid.bins))
    figure, (above, below) = plt.subplots(2, 1, figsize=(7, 4.2), sharex=True)
    t = record.grid.centre[shown]
    above.plot(t, a.held_out.measured[0][0][shown, 0], color="0.2", lw=1, label="recorded")
    above.plot(t, fits[2].predicted[0][0][shown, 0], color="C0", lw=1, label="improved")
    for fit, colour, label in ((fits[0], "C1", "nominal"), (fits[2], "C0", "improved")):
        below.plot(t, fit.residuals[0][0][shown, 0], color=colour, lw=0.9, label=label)
    above.set(ylabel=f"{block.name} / {unit}", title=f"held out: {record.name}")
    below.set(xlabel="time / s", ylabel=f"residual / {unit}")
    for axes in (above, below):
        axes.legend(loc="upper right", fontsize=8, frameon=False)
    figure.tight_layout()
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=80)
    plt.close(figure)


HEAD = """# Hidden physics in published recordings

Made by `make real-recordings`, from recordings that others made and published; they are not part of
this project. Each case is one ordinary analysis, `slipbench explain --vehicle MODEL RUN...
--held-out RUN...`, with a role map (`examples/roles`) and a model file (`examples/models`). Errors
are RMS errors on the held-out recordings: of the model file as written, of the calibrated model, and
of the improved model with the fitted effects. "None of the library" means: a free curve would still
explain more than 5 % of what the effects explain (curves/adequacy.py), and predicts the held-out
recordings better. Then the names are withdrawn, and the effects are shown as a fit, not as a cause.

**How far this can be trusted.** No effect and no significance test was fitted to these recordings,
but this is no blind validation: parts of the method and of the model files were changed after
results on them had been seen, results on held-out parts among them. "Held out" means here that the
fit did not use a recording. Held-out recordings take part in the selection: an effect that they
contradict is rejected (listed as such), and a free curve counts only where they agree with it. For
the method these are development data. `slipbench prove` measures what it does on unseen cases.
Changes after a result had been seen:

- flexible link (six runs): noise models of model files forget within a third of a segment;
  sensitivities are updated where parameters move far; prior deviations of its initial values;
- accelerometer: the slope of the wheel speed is taken over 0.5 s instead of 0.2 s; noise of that
  slope; gravity along the road as a slow unknown;
- Silverbox: cubic interpolation of the input instead of held values or straight lines;
- front wheels of the WRX: a part of the drive where the road is straight; wheel patterns removed;
  noise of the left wheel and steering angle in the model file;
- coupled drives: binary and uniform noise are separate cases, because the gains differ by a factor
  of 2 to 3; fits start at the parameters of the file, by least squares, with look-ahead;
- residuals are tested by their share of the mean square (before: 60 nats), after Silverbox, drives
  and tanks had lost names that explained nearly everything;
- swap steps, after the training run of the tanks needed a set of three effects that no
  single step reaches;
- names that do not suffice stand where no curve in their place predicts better, after the front
  wheel of the Yamaha had lost names that reduce its held-out error from 1.5 to 0.7 m/s in favour of
  a curve that reduces it to 1.3;
- the same where no curve stands at all, after the tanks and the uniform drives had lost names that
  bring 205 and 110 nats on the held-out recordings, for nothing;
- inputs along lines may hold noise, first rows count, and recordings are fitted from their beginning on where that
  leads farther, after recordings of our own making (a crane, a wheel against satellites); the results here were
  looked at and not acted on;
- the effect linear_loss (a loss in proportion to the stored quantity), after a square at the sensor
  of the tanks had taken its place, at 0.43 V;
- places of the new effects, after the front wheel of the Yamaha had lost its lean to a torque ripple
  and the drives had got braking loops: what repeats with an angle needs one that goes round, a
  position loop a position; look-ahead from 16 kinds instead of 8; ties of pairs in the order of
  plausibility, after the accelerometer had lost its reversed sign to a pair 2 nats better;
- curves located by plain least squares count ten times their p, after a surrogate of the tanks, in
  which nothing is missing, had raised an alarm at p = 0.011.

A version is the SHA-256 of the analysis code and the model files; a section stays until its case is
run again, and sections of several versions may stand side by side. Times are processor time / wall
time, on a shared machine.

"""


def _summary(results: dict[str, dict[str, Any]]) -> str:
    lines = [
        "| recording | identified effects | held-out RMS error: as written -> improved | time, s |",
        "|---|---|---|---|",
    ]
    for case in CASES:
        result = results.get(case.name)
        if result is None:
            lines.append(f"| {case.title} | not run again: see its section | | |")
            continue
        named = ", ".join(f"{e['name']} at {e['subject']}" for e in result["effects"])
        open_end = "none of the library" if result["unknown"]["found"] else "no mismatch"
        rows = [r["errors"] for r in result["by_record"]]
        errors = "; ".join(f"{n:.3g} -> {i:.3g}" for n, _, i in rows)
        took = f"{result['processor']:.0f} / {result['seconds']:.0f}"
        lines.append(f"| {case.title} | {named or open_end} | {errors} | {took} |")
    return "\n".join([*lines, ""])


def _page() -> None:
    paths = {case.name: BUILD / case.name / "verdict.json" for case in CASES}
    results = {
        name: json.loads(path.read_text(encoding="utf-8"))
        for name, path in paths.items()
        if path.exists()
    }
    page = DOCS / "real_recordings.md"
    before = _sections(page)
    parts = [HEAD, _summary(results)]
    for case in CASES:
        if case.name in results:
            parts.append(_section(case, results[case.name]))
        else:
            bare = f"## {case.title}\n\nKnown beforehand: {case.known}\n\nNot run.\n"
            parts.append(before.get(case.title, bare))
    page.write_text("\n".join(parts), encoding="utf-8")


def _sections(page: Path) -> dict[str, str]:
    """Sections of an existing page, by title; a case that was not run keeps its section."""
    text = page.read_text(encoding="utf-8") if page.exists() else ""
    found = (f"## {part.rstrip()}\n" for part in text.split("\n## ")[1:])
    return {part.partition("\n")[0].removeprefix("## "): part for part in found}


def _section(case: Case, result: dict[str, Any]) -> str:
    where = result["location"]
    located = (
        "none"
        if where is None
        else (
            f"{where['injection']} as a function of {where['regressor']}: {where['shape']}"
            f" (log-likelihood gain {where['gain']:.0f} nats, held out {where['confirmed']:.0f})"
        )
    )
    lines = [
        f"## {case.title}",
        "",
        f"Known beforehand: {case.known}",
        "",
        f"> {result['sentence']}",
        "",
        f"- Model file {_model_name(case)}; training {', '.join(case.training)};"
        f" held out {', '.join(case.held_out)}; time {result['processor']:.0f} /"
        f" {result['seconds']:.0f} s; version {result['code']}.",
        f"- Located: {located}.",
        *(f"- Reading: {note}." for note in dict.fromkeys(result["notes"])),
        f"- Identified effects: {_effects(result)}.",
        *(
            f"- Rejected by the held-out recordings: {veto['name']} ({veto['reason']})."
            for veto in result["vetoes"]
        ),
        *_residual(result),
        *(f"- Indistinguishable here: {', '.join(names)}." for names in result["equivalents"]),
        "",
        "| held out | output | as written | calibrated | improved |",
        "|---|---|---|---|---|",
    ]
    for row in result["by_record"]:
        n, c, i = row["errors"]
        name = row["record"]
        lines.append(f"| {name} | {row['output']} | {n:.4g} | {c:.4g} | {i:.4g} |")
    if case.name in REMARKS:
        lines += ["", REMARKS[case.name]]
    figure = DOCS / "figures" / f"real_{case.name}.png"
    if result.get("figure", _digest(figure)) == _digest(figure):
        lines += ["", f"![{case.title}](figures/real_{case.name}.png)"]
    lines.append("")
    return "\n".join(lines)


def _residual(result: dict[str, Any]) -> list[str]:
    residual = result["remains"]
    if residual is None:
        return []
    return [
        f"- Residual: {residual['injection']} as a function of {residual['regressor']},"
        f" {residual['shape']}; {100 * residual['share']:.2g} % of the mean square that the effects"
        " explain."
    ]


def _model_name(case: Case) -> str:
    if case.model.startswith("improved/"):
        return f"improved in the section on {Path(case.model).name.replace('_', ' ')}"
    return f"`examples/models/{case.model}.toml`"


def _effects(result: dict[str, Any]) -> str:
    if result["unknown"]["found"]:
        return "none of the library"
    found = [
        f"{e['name']} at {e['subject']} ("
        + ", ".join(
            f"{p['name']} {p['value']:.4g} [{p['interval'][0]:.4g}, {p['interval'][1]:.4g}]"
            f" {p['unit']}"
            for p in e["parameters"]
        )
        + ")"
        for e in result["effects"]
    ]
    return "; ".join(found) or "none"


if __name__ == "__main__":
    main(sys.argv[1:] or [os.environ.get("SLIPBENCH_RECORDINGS", "../shared/recordings")])
