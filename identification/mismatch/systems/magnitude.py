"""Usual magnitude of the rate of a state: what its equation gives for usual inputs and states.

The size of a state tells how large it is, not how fast it changes. So the equation is evaluated for
inputs and states drawn within their sizes, and the root mean square is taken.
"""

import math
from collections.abc import Iterator

import numpy as np

from slipbench.identification.mismatch.systems.arithmetic import value_of
from slipbench.identification.mismatch.systems.equations import equations
from slipbench.identification.mismatch.systems.model_file import DrivenState, ModelFile

DRAWS = 64
SEED = 1


def usual_rates(file: ModelFile) -> dict[str, float]:
    """Usual magnitude of the rate of each state, SI.

    Where no draw can be evaluated, and where the rate is known to an outside simulation only, it is
    the size of the state in a sampling period.
    """
    slowest = {name: abs(state.size.si) / file.period for name, state in file.states.items()}
    if any(isinstance(state, DrivenState) for state in file.states.values()):
        return slowest
    drawn = [found for found in _draws(file) if all(map(math.isfinite, found))]
    if not drawn:
        return slowest
    usual = np.sqrt(np.mean(np.square(drawn), axis=0))
    return {n: float(u) or slowest[n] for n, u in zip(file.states, usual, strict=True)}


def _draws(file: ModelFile) -> Iterator[list[float]]:
    """Yield the rates of all states for drawn inputs and states, where they can be evaluated."""
    rng = np.random.default_rng(SEED)
    equations(file, file.name)  # refuses what is not arithmetic
    sizes = {name: abs(told.size.si) for name, told in file.inputs.items()}
    sizes |= {name: abs(told.size.si) for name, told in file.states.items()}
    for _ in range(DRAWS):
        known = {name: number.si for name, number in file.parameters.items()}
        known |= {name: size * float(rng.uniform(-1.0, 1.0)) for name, size in sizes.items()}
        try:
            for name, seam in file.seams.items():
                known[name] = value_of(seam.value, known)
            yield [value_of(state.rate, known) for state in file.states.values()]
        except (ArithmeticError, ValueError):
            continue
