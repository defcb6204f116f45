"""How far a number is moved to measure by differences what it does.

In a narrow valley a difference over too large a step points across it, and no step leads on: a fit of
a motor that warms stopped 7 000 nats before the optimum. So a number moves no farther than the
recordings resolve. Where a simulation rounds as its sensors do, as that of a motorcycle with its
teeth, smaller steps of its parameters would show stairs: there the usual steps stay. Effects always take
such steps: 5 % of a wet patch was 250 standard deviations, and its fit ended 6 nats from where
its slopes led.
"""

import math

import numpy as np

from slipbench.plant.signals import Floats

RESOLVED = 10.0
"""Standard deviations of the noise by which all whitened residuals together may change."""


def strengths_of(columns: Floats) -> tuple[float, ...]:
    """Return how much a unit of each number changes whitened residuals. columns: (rows, numbers)."""
    return tuple(np.linalg.norm(columns, axis=0).tolist())


def step_of(usual: float, strength: float) -> float:
    """Return the step of a difference, with the sign of the usual one and not larger."""
    if strength * abs(usual) <= RESOLVED:
        return usual
    return math.copysign(RESOLVED / strength, usual)
