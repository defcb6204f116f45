"""Prediction of held-out runs by a model."""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.models.rational_model import RationalModel
from slipbench.identification.models.time_check import fit_percent
from slipbench.protocol.recording.channel import FloatArray


@dataclass(frozen=True)
class HeldOut:
    """One run against the model's response to its input.

    name                      of the run
    time, measured, predicted (n,): s, and the output
    error                     root mean square of the difference, in the output's unit
    fit                       %, 100 (1 - |measured - predicted| / |measured - mean|)
    """

    name: str
    time: FloatArray
    measured: FloatArray
    predicted: FloatArray
    error: float
    fit: float


@dataclass(frozen=True)
class Rest:
    """Input and output before the runs that a model was fitted to."""

    u: float
    y: float


def held_out(
    model: RationalModel, name: str, u: FloatArray, y: FloatArray, rate: float, rest: Rest
) -> HeldOut:
    """Response of a model to u, (n,) at `rate` Hz, from rest; nothing of y is used."""
    given = np.concatenate(([rest.u], u))
    predicted = model.simulate(given - rest.u, rate)[1:] + rest.y
    error = float(np.sqrt(np.mean((y - predicted) ** 2)))
    return HeldOut(name, np.arange(u.size) / rate, y, predicted, error, fit_percent(y, predicted))
