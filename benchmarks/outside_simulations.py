"""The same verdict from an FMU and from a function as from the model file with the same equations.

Cases are springs with a hidden effect at the force or in the sensor, or with none; each case's size
is drawn at random. Every case is explained three times: the equations as a model file, as an FMU for
co-simulation (compiled with gcc) and as a Python function.

    python benchmarks/outside_simulations.py --cases 6 --seed 1 --out docs/outside_simulations.md
"""

import argparse
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

sys.path.insert(0, str(Path(__file__).parents[1]))  # the known systems are the tests' own

from slipbench.identification.mismatch.reporting.verdict import Verdict
from slipbench.identification.mismatch.runs import read_system
from slipbench.identification.mismatch.simulation.system import System
from slipbench.protocol.recording.recording import Recording
from tests.identification.mismatch.callables import springs
from tests.identification.mismatch.callables.fmus.building import build, with_file
from tests.identification.mismatch.laws.explained import explained, names
from tests.identification.mismatch.laws.spring import PERIOD, spring, swung

Signal = Callable[[np.ndarray], np.ndarray]
LIBRARY = ["dead_zone", "saturation", "lag", "hysteresis", "sensor_delay", "delay", "offset"]
WAYS = ("model file", "FMU", "function")


@dataclass(frozen=True)
class Case:
    """A hidden effect. names: as in a verdict; value: its size, in its unit."""

    seed: int
    names: tuple[str, ...]
    value: float
    felt: Signal
    sensed: Signal

    def recordings(self) -> list[Recording]:
        """One to learn from, one held out."""
        return [swung(2 * self.seed + k, felt=self.felt, sensed=self.sensed) for k in (0, 1)]


def _same(signal: np.ndarray) -> np.ndarray:
    return signal


def _dead_zone(width: float) -> Signal:
    return lambda force: force - np.clip(force, -width, width)


def _saturation(limit: float) -> Signal:
    return lambda force: np.clip(force, -limit, limit)


def _lag(time_constant: float) -> Signal:
    """A first-order lag of what follows straight lines between samples."""
    kept = np.exp(-PERIOD / time_constant)
    new = 1.0 - (1.0 - kept) * time_constant / PERIOD
    return lambda place: np.asarray(lfilter([new, 1.0 - kept - new], [1.0, -kept], place))


def case(number: int, seed: int) -> Case:
    """Draw a case: kinds take turns, sizes are random."""
    random = np.random.default_rng((seed, number))
    kind = ("nothing", "dead_zone.force", "saturation.force", "lag.place")[number % 4]
    if kind == "dead_zone.force":
        width = random.uniform(0.15, 0.4)
        return Case(number, (kind,), width, _dead_zone(width), _same)
    if kind == "saturation.force":
        limit = random.uniform(0.8, 1.4)
        return Case(number, (kind,), limit, _saturation(limit), _same)
    if kind == "lag.place":
        lag = random.uniform(0.03, 0.08)
        return Case(number, (kind,), lag, _same, _lag(lag))
    return Case(number, (), 0.0, _same, _same)


@dataclass(frozen=True)
class Result:
    """Result of one way. size: value and interval of the first effect; seconds: of it."""

    names: tuple[str, ...]
    size: tuple[float, float, float] | None
    seconds: float


def explained_in_one_way(system: System, recordings: list[Recording]) -> Result:
    """Explain a case in one way."""
    begun = time.process_time()
    found: Verdict = explained(system, recordings[:1], recordings[1:], LIBRARY)
    sizes = [p for e in found.effects for p in e.parameters]
    size = (sizes[0].value, sizes[0].low, sizes[0].high) if sizes else None
    return Result(tuple(names(found)), size, time.process_time() - begun)


def explain_case(one: Case, folder: Path) -> dict[str, Result]:
    """Explain a case in every way."""
    recordings = one.recordings()
    systems = {
        "model file": lambda: spring(folder / "model"),
        "FMU": lambda: read_system(folder / "spring.fmu"),
        "function": lambda: springs.system(recordings[:1]),
    }
    return {way: explained_in_one_way(systems[way](), recordings) for way in WAYS}


def lines(found: list[tuple[Case, dict[str, Result]]], command: str) -> Iterator[str]:
    """Yield the lines of the page."""
    same = sum(len({_response(t.names) for t in by.values()}) == 1 for _, by in found)
    right = {
        way: sum(_response(by[way].names) == _response(one.names) for one, by in found)
        for way in WAYS
    }
    yield "# Simulations from outside: the same verdicts\n"
    yield (
        "`explain` takes a model file, an FMU or a Python function. Here the same equations, a mass on"
        " a spring with wrong parameters, are given in all three ways, and recordings of a spring with"
        " a hidden effect of random size.\n"
    )
    yield (
        f"The three ways name the same effects in {same} of {len(found)} cases. A lag before and a lag"
        " behind a linear spring have the same response: they count as the same.\n"
    )
    yield "| case | hidden | " + " | ".join(WAYS) + " |"
    yield "|---|---|" + "---|" * len(WAYS)
    for one, by in found:
        hidden = f"{one.names[0]}, {one.value:.4g}" if one.names else "nothing"
        yield f"| {one.seed} | {hidden} | " + " | ".join(_cell(by[way]) for way in WAYS) + " |"
    yield "| right | | " + " | ".join(f"{right[way]} of {len(found)}" for way in WAYS) + " |"
    yield "\nIn brackets: 95 % interval of the effect's size, in its unit (V, or s of a lag).\n"
    yield f"`{command}`"


def _response(found: tuple[str, ...]) -> tuple[str, ...]:
    """Names of effects, without the place of a lag, which a linear system does not show."""
    return tuple("lag" if name.startswith("lag.") else name for name in found)


def _cell(one: Result) -> str:
    if one.size is None:
        return ", ".join(one.names) or "nothing"
    value, low, high = one.size
    return f"{', '.join(one.names)}: {value:.4g} ({low:.4g} to {high:.4g})"


def main() -> None:
    """Explain all cases and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=8)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    options = parser.parse_args()
    found = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with_file(build(folder, 3))
        (folder / "model").mkdir()
        for number in range(options.cases):
            one = case(number, options.seed)
            found.append((one, explain_case(one, folder)))
            print(one.names, one.value, found[-1][1], flush=True)
    script = "python benchmarks/outside_simulations.py"
    command = f"{script} --cases {options.cases} --seed {options.seed} --out {options.out}"
    options.out.write_text("\n".join(lines(found, command)) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
