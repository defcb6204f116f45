"""docs/outside.md: published data and scores beside ours."""

from collections.abc import Iterator, Mapping
from typing import Any

from benchmarks.outside.benchmarks import BENCHMARKS, SOURCES, Benchmark

HEAD = """# Published benchmarks

Made by `make outside`: published data, split as published, and published figures beside ours.

- **Given to us:** a model file (`examples/models`) with the physics that anybody would write down first, and the training data.
  The missing physics is not in it: `slipbench explain` has to identify it.
- **Split:** that of the official loader of nonlinearbenchmark.org, the package nonlinear_benchmarks. The test data take part in no decision of the
  analysis. The initial state of a test is estimated from its first samples, which the loader permits; they are not part of the error.
- **Error:** root mean square error of the simulation on the test; no measured output is fed back.
- **Figures of publications** were read in the cited text. Where the split of a publication could not be verified, its section says so.
- **How far this can be trusted:** the library of effects and the method were developed with these recordings at hand
  ([real recordings](real_recordings.md) lists the changes); the comparison is therefore not blind. [Blind validation](blind_validation.md) is.
- Published models are mostly black boxes that are fitted to all training data. Ours are few parameters with a physical meaning each; low
  error is not their only purpose.

"""
TAIL = """## Not compared

- Flexible link, robot arm, ball and beam, and the recordings of vehicles: no publication with a split and a figure of merit was found.
- Coupled electric drives with binary noise: no split was found in the official loader; [real recordings](real_recordings.md) has this case.
"""


def page(results: Mapping[str, Mapping[str, Any]]) -> str:
    """Text of the page. results: by benchmark; one that was not run says so."""
    parts = [HEAD + "\n".join(_summary(results)) + "\n"]
    parts += ["\n".join(_section(b, results.get(b.name))) for b in BENCHMARKS]
    sources = "\n".join(f"- {name}: {text}." for name, text in SOURCES.items())
    return "\n".join((*parts, TAIL, f"## Sources\n\n{sources}\n"))


def _summary(results: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    yield "| benchmark, test | published | ours | processor time, s |"
    yield "|---|---|---|---|"
    for b in BENCHMARKS:
        for test in b.tests:
            figures = sorted(f.value for f in b.figures if f.test == test.name)
            published = " to ".join(dict.fromkeys(f"{v:.3g}" for v in (figures[0], figures[-1])))
            result = results.get(b.name)
            best = _last(result, test.name) if result else "not run"
            used = f"{result['processor']:.0f}" if result else ""
            yield f"| {b.title}, {test.name} | {published} {b.unit} | {best} {b.unit} | {used} |"


def _last(result: Mapping[str, Any], test: str) -> str:
    """Return the error of the last model: with the identified effects, where there are any."""
    return f"{[e['rms'] for e in result['errors'] if e['test'] == test][-1]:.3g}"


def _why(result: Mapping[str, Any]) -> str:
    """Say that the names are not the verdict, where a residual remains beside them."""
    return " (withdrawn as names, because a residual remains)" if result["withdrawn"] else ""


def _section(b: Benchmark, result: Mapping[str, Any] | None) -> Iterator[str]:
    yield f"## {b.title}"
    yield ""
    yield f"Data: {b.publication}."
    yield ""
    yield f"- Given to us: `examples/models/{b.model}.toml` and the training data."
    yield f"- Split: {b.split} The first {b.first} samples of a test set its initial state."
    if result is None:
        yield "- Not run."
    else:
        yield (
            f"- Time of the analysis: {result['processor']:.0f} s of processor time,"
            f" {result['seconds']:.0f} s of wall time on a shared machine with two cores."
        )
        yield f"- What was said: {result['sentence']}"
        yield f"- Effects of the last model: {', '.join(result['effects']) or 'none'}{_why(result)}."
    if b.note:
        yield f"- Note: {b.note}"
    yield ""
    yield f"| test | model | RMS error, {b.unit} | source |"
    yield "|---|---|---|---|"
    for test in b.tests:
        for e in result["errors"] if result else ():
            if e["test"] == test.name:
                yield f"| {test.name} | ours, {e['model']} | {e['rms']:.3g} | {e['samples']} samples |"
        for f in b.figures:
            if f.test == test.name:
                yield f"| {test.name} | {f.method} | {f.value:.3g} | {f.source} |"
    yield ""
