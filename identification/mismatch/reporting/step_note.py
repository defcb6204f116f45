"""Whether the step of integration is small enough for these recordings."""

from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.naming.acceptance import ENOUGH
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.plant.errors import PlantError


def step_note(fit: Fit) -> str:
    """Say by how much half of the step changes the simulation; empty where that does not count.

    A change worth as many nats as an effect must bring can be taken for one.
    """
    nats = nats_of_half_a_step(fit)
    if nats < ENOUGH:
        return ""
    return (
        f"step: half of it changes the simulation by {nats:.0f} nats, and small lags, delays or leaks"
        f" may come from it; try half of the step in the file"
    )


def nats_of_half_a_step(fit: Fit) -> float:
    """Return half the square of the whitened change of all outputs; 0 where it cannot be told."""
    finer = fit.model.system.with_half_a_step()
    if finer is None:
        return 0.0
    try:
        there = predict(replace(fit.model, system=finer), fit.point)
    except PlantError:
        return 0.0
    change = [
        [(a - b) * k for a, b, k in zip(new, old, known, strict=True)]
        for new, old, known in zip(there, fit.predicted, fit.model.known_bins, strict=True)
    ]
    return 0.5 * float(np.sum(whiten_and_stack(fit.model, fit.noise, change) ** 2))
