"""Usual magnitude of the rate of a state: RMS of its equation over random inputs and states.

The size of a state is the magnitude of its value, not of its rate. So the equation is evaluated for
inputs and states drawn uniformly within their sizes, and the root mean square is taken.
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
    """Return the usual magnitude of the rate of each state, SI.

    Where no draw can be evaluated, and where an outside simulation computes the rate, it is the
    size of the state per period of the model file.
    """
    fallback = {name: abs(state.size.si) / file.period for name, state in file.states.items()}
    if any(isinstance(state, DrivenState) for state in file.states.values()):
        return fallback
    samples = [rates for rates in _draws(file) if all(map(math.isfinite, rates))]
    if not samples:
        return fallback
    rms = np.sqrt(np.mean(np.square(samples), axis=0))
    return {
        name: float(value) or fallback[name] for name, value in zip(file.states, rms, strict=True)
    }


def _draws(file: ModelFile) -> Iterator[list[float]]:
    """Yield the rates of all states for random inputs and states, where they can be evaluated."""
    rng = np.random.default_rng(SEED)
    equations(file, file.name)  # raises InputError unless all is arithmetic
    sizes = {name: abs(entry.size.si) for name, entry in file.inputs.items()}
    sizes |= {name: abs(entry.size.si) for name, entry in file.states.items()}
    for _ in range(DRAWS):
        known = {name: number.si for name, number in file.parameters.items()}
        known |= {name: size * float(rng.uniform(-1.0, 1.0)) for name, size in sizes.items()}
        try:
            for name, seam in file.seams.items():
                known[name] = value_of(seam.value, known)
            yield [value_of(state.rate, known) for state in file.states.values()]
        except (ArithmeticError, ValueError):
            continue
