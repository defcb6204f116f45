"""Finite-difference step of a parameter.

In a narrow valley a difference over too large a step points across the valley, and no step improves
the fit: a fit of a motor that warms stopped 7 000 nats before the optimum. The step is therefore
limited to what the recordings resolve. Where a simulation quantizes as its sensors do, like that of
a motorcycle with its teeth, smaller steps of its parameters would resolve the quantization steps;
there the default steps are kept. Effects always take limited steps: 5 % of a wet patch was 250
standard deviations, and its fit ended 6 nats from the optimum of its linearization.
"""

import math

import numpy as np

from slipbench.plant.signals import Floats

RESOLVED = 10.0
"""Largest change of all whitened residuals together, in standard deviations of the noise."""


def strengths_of(columns: Floats) -> tuple[float, ...]:
    """Return the change of whitened residuals per unit of each column. columns: (rows, p)."""
    return tuple(np.linalg.norm(columns, axis=0).tolist())


def step_of(default: float, strength: float) -> float:
    """Return a finite-difference step with the sign of the default one, and not larger."""
    if strength * abs(default) <= RESOLVED:
        return default
    return math.copysign(RESOLVED / strength, default)
