"""The page docs/other_fmus.md."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from benchmarks.other_fmus.cases import CASES, Case
from benchmarks.other_fmus.comparison import FINE, SWING, TOLERANCE
from benchmarks.other_fmus.explained import SEEDS
from benchmarks.other_fmus.fetch import OTHERS, REFERENCE

HEAD = f"""# FMUs of other tools

Made by `make other-fmus` (`python -m benchmarks.other_fmus.run`). The FMUs are the Reference FMUs of the Modelica Association's project, and FMUs
of OpenModelica, MapleSim and PythonFMU3. They are taken from the packages {REFERENCE.name} {REFERENCE.version} and {OTHERS.name}
{OTHERS.version}; none is kept in this repository. The Reference FMUs Clocks and Resource are in neither package. An FMU with clocks that have to be
ticked from outside, as Clocks, is refused with a sentence; [a test](../tests/identification/mismatch/callables/test_fmu_variables.py)
builds one.

`slipbench export-fmu` checks FMUs that slipbench makes, so it does not apply here; every FMU below is read by `slipbench explain`.

## Read and simulated

All inputs and outputs that are numbers are bound, arrays element by element, and the FMU is simulated by slipbench and by fmpy with the same
inputs: sines or switches that move by {SWING:g} of the start value, or by 1 where this is 0. Strings and binaries keep their start values. The
difference is the largest of any output, in shares of the output's largest value.

In co-simulation both call the same steps. In model exchange slipbench takes {FINE} steps of the classical Runge-Kutta rule in each row, fmpy CVode with
a relative tolerance of {TOLERANCE:g}; the inputs of an FMU with states are constant there, because fmpy sets inputs once in a step of its solver.
Samples at which a switch jumps are left out: the value before or after the jump is a convention.

| FMU | tool | FMI | types | interface | step, s | rows | largest difference |
|---|---|---|---|---|---|---|---|
"""
MIDDLE = """
The solvers of some Reference FMUs take steps of up to 1 s in co-simulation. A step of communication that is shorter is refused where the FMU states its
own (FMI 3.0): the outputs would stand still between its steps.

## Explained

Each case is one training recording and one held-out recording of a machine that differs from the FMU, as tables, analysed by
`slipbench explain model.fmu training.csv --held-out held_out.csv` with the whole library of effects. The recordings are simulated by fmpy with other
parameters, or by equations of our own where an effect acts inside. Seeds: {seeds}, of the inputs and the noise. An FMU without inputs gives the same motion
in both recordings, with other noise.

{right} of {count} cases are right: what was planted is named alone (or tied with names of the same meaning), or nothing is found where nothing was
planted. The error is that of the output that falls most by what was named.

| case | planted | named | right | error held out: as stated, calibrated, with the effect | noise | gain, nats | time, s |
|---|---|---|---|---|---|---|---|
"""
NAMES = {"co_simulation": "co-simulation", "model_exchange": "model exchange"}


def page(simulated: Sequence[Mapping[str, Any]], results: Mapping[str, Any]) -> str:
    """Text of the page. simulated: by FMU; results: by name of the case."""
    run = [case for case in CASES if case.name in results]
    middle = MIDDLE.format(
        seeds=" and ".join(map(str, SEEDS)),
        right=sum(bool(results[case.name].get("right")) for case in run),
        count=len(run),
    )
    table = "\n".join(line for one in simulated for line in _simulated(one))
    cases = "\n".join(_row(case, results[case.name]) for case in run)
    verdicts = "\n".join(line for case in run for line in _told(case, results[case.name]))
    return f"{HEAD}{table}\n{middle}{cases}\n\n{verdicts}"


def _simulated(one: Mapping[str, Any]) -> Iterator[str]:
    types = ", ".join(one["types"]) + (", arrays" if one["arrays"] else "")
    for c in one["compared"]:
        start = f"| {one['name']} | {one['tool']} | {one['version']} | {types} | {NAMES[c['interface']]}"
        if c["problem"]:
            yield f"{start} | | | {c['problem']} |"
        else:
            yield f"{start} | {c['step']:g} | {c['rows']} | {c['difference']:.1g} |"


def _row(case: Case, result: Mapping[str, Any]) -> str:
    planted = case.planted or "nothing"
    if "problem" in result:
        return f"| {case.title} | {planted} | refused | no | | | | |"
    named = ", ".join(f"`{name}`" for name in result["named"]) or "nothing"
    if result["mismatch"] and not result["named"]:
        named = "a mismatch, no name"
    after = "improved" if result["named"] else "floor"
    error = max(result["held_out"], key=lambda e: e["calibrated"] / e[after])
    unit = "" if error["unit"] == "1" else f" {error['unit']}"
    shown = ", ".join(f"{error[key]:.3g}" for key in ("nominal", "calibrated", "improved"))
    gain = (result["improvement"] or {}).get("log_likelihood_gain")
    return (
        f"| {case.title} | {planted} | {named} | {'yes' if result['right'] else 'no'} |"
        f" {error['output']}: {shown}{unit} | {_noise(case, error['output'])} |"
        f" {'' if gain is None else f'{gain:.0f}'} | {result['seconds']:.0f} |"
    )


def _noise(case: Case, output: str) -> str:
    """Return the standard deviation of the noise of an output."""
    by_role = {title.partition(" [")[0].replace(" ", "_"): sd for title, sd in case.noise.items()}
    return f"{by_role.get(output, 0.0):g}"


def _told(case: Case, result: Mapping[str, Any]) -> Iterator[str]:
    yield f"### {case.title}\n"
    yield f"- Of the machine: {case.changed}; {case.planted or 'nothing else'}."
    if "problem" in result:
        yield f"- Said: {' '.join(result['problem'].split())}"
    else:
        yield f"- Said: {result['sentence'] or 'no sentence'}"
    if case.remark:
        yield f"- Remark: {case.remark}"
    yield ""
