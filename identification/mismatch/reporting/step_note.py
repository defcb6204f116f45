"""Check whether the integration step is small enough for these recordings."""

from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.identification.mismatch.thresholds import REQUIRED_GAIN
from slipbench.plant.errors import PlantError


def step_note(fit: Fit) -> str:
    """Report by how much half the step changes the simulation; empty where it is negligible.

    A change of ENOUGH nats or more can be mistaken for an effect.
    """
    nats = nats_of_half_a_step(fit)
    if nats < REQUIRED_GAIN:
        return ""
    return (
        f"step: half of it changes the simulation by {nats:.0f} nats, and small lags, delays or leaks"
        f" may come from it; try half of the step in the file"
    )


def nats_of_half_a_step(fit: Fit) -> float:
    """Return half the squared norm of the whitened change, nats; 0 where it cannot be computed."""
    finer_system = fit.model.system.with_half_a_step()
    if finer_system is None:
        return 0.0
    try:
        finer_prediction = predict(replace(fit.model, system=finer_system), fit.point)
    except PlantError:
        return 0.0
    change = [
        [(a - b) * k for a, b, k in zip(new, old, known_bins, strict=True)]
        for new, old, known_bins in zip(
            finer_prediction, fit.predicted, fit.model.known_bins, strict=True
        )
    ]
    return 0.5 * float(np.sum(whiten_and_stack(fit.model, fit.noise, change) ** 2))
