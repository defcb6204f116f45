"""Errors of harmonics from one sweep: along the phase, and from slices as in the paper.

`python benchmarks/harmonics.py [seeds]` prints one table. A nonlinearity before a resonance of 8 Hz
with dead time, whose harmonics are known exactly; coloured noise and a drifting mean. Where H is 1 the
harmonics are 1, 0.12 and 0.02. Errors are root mean squares from 1 to 11 Hz relative to the truth.
Slices have a bias, because a sweep is not stationary in them: less noise does not reduce it.
"""

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))  # the known systems are the tests' own

from slipbench.identification.response.describing_function import DescribingFunction, sliced
from slipbench.identification.response.harmonics import harmonics
from slipbench.identification.response.swept_run import SweptRun, swept_run
from tests.identification.response.known_harmonics import RATE, Curved, coloured, drift, sweep

AMPLITUDE, SEEDS = 0.04, 10
METHODS = {"slices": sliced, "along the phase": harmonics}
CASES = [(12.0, 0.02, 1), (12.0, 0.05, 1), (12.0, 0.05, 4), (30.0, 0.05, 1), (30.0, 0.05, 4)]


def run(duration: float, noise: float, seed: int) -> SweptRun:
    """Simulate one sweep; noise: standard deviation beside the first harmonic."""
    u = AMPLITUDE * sweep(duration=duration)
    y = Curved().answer(u) + coloured(u.size, seed, noise * AMPLITUDE) + drift(u.size, seed, 0.002)
    made = swept_run(u, y, RATE)
    assert isinstance(made, SweptRun)
    return made


def errors(found: DescribingFunction) -> np.ndarray:
    """Relative error of each harmonic, and the share of bins whose truth is inside the 95 % interval."""
    inside = (found.frequency > 1) & (found.frequency < 11)
    truth = Curved().harmonics(found.frequency, AMPLITUDE)[:, inside]
    error = np.abs(found.value[:, inside] - truth)
    size = np.sqrt(np.mean(np.abs(truth) ** 2, axis=1))
    radius = found.quantile / 1.96 * np.sqrt(-np.log(0.05)) * found.deviation[:, inside]
    return np.append(np.sqrt(np.mean(error**2, axis=1)) / size, np.mean(error < radius))


def main(seeds: int) -> None:
    """Print the table."""
    print(
        f"{'sweep':>6} {'noise':>6} {'runs':>5} {'method':<16}{'1st':>8}{'2nd':>8}{'3rd':>8}"
        f"{'in band':>9}{'time':>9}"
    )
    for duration, noise, runs in CASES:
        made = [[run(duration, noise, 100 * s + r) for r in range(runs)] for s in range(seeds)]
        for name, method in METHODS.items():
            start = time.perf_counter()
            found = [method(several) for several in made]
            took = (time.perf_counter() - start) / seeds
            kept = [errors(one) for one in found if isinstance(one, DescribingFunction)]
            row = "".join(f"{100 * x:7.1f}%" for x in np.mean(kept, axis=0)[:3])
            print(
                f"{duration:5.0f}s {100 * noise:5.0f}% {runs:5d} {name:<16}{row}"
                f"{100 * np.mean(kept, axis=0)[3]:8.0f}%{1e3 * took:7.0f}ms"
            )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS)
