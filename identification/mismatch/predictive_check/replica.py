"""Simulate the recordings of an analysis from its accepted fit."""

import numpy as np

from slipbench.identification.mismatch.analysis import Analysis, accepted, begin
from slipbench.identification.mismatch.predictive_check.draw import (
    draw_from_posterior,
    without_effects,
)
from slipbench.identification.mismatch.predictive_check.noise import noise_like
from slipbench.identification.mismatch.predictive_check.outcome import simulated_effects
from slipbench.identification.mismatch.simulation.replicate import replicated
from slipbench.plant.effects.effect import Effect


def simulated(
    a: Analysis, rng: np.random.Generator, with_effects: bool
) -> tuple[Analysis, dict[str, Effect]]:
    """Return a new analysis of simulated recordings, and the simulated effects by name."""
    noise = noise_like(accepted(a), rng)
    held_out_noise = noise_like(a.held_out_runs[2], rng) if a.held_out_runs else []
    fit, held_out = draw_from_posterior(a, rng)
    if not with_effects:
        fit, held_out = without_effects(fit, held_out)
    training = replicated(fit.model, fit.point, noise, a.training.records)
    held_out_records = []
    if held_out is not None and a.held_out is not None:
        held_out_records = replicated(
            held_out.model, held_out.point, held_out_noise, a.held_out.records
        )
    return begin(a.system, training, held_out_records), simulated_effects(fit)
