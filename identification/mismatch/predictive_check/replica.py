"""Recordings simulated from the accepted fit of an analysis, as a new analysis."""

import numpy as np

from slipbench.identification.mismatch.analysis import Analysis, accepted, begin
from slipbench.identification.mismatch.predictive_check.draw import bare, drawn
from slipbench.identification.mismatch.predictive_check.noise import noise_like
from slipbench.identification.mismatch.predictive_check.outcome import simulated_effects
from slipbench.identification.mismatch.simulation.replicate import replicated
from slipbench.plant.effects.effect import Effect


def simulated(
    a: Analysis, rng: np.random.Generator, with_effects: bool
) -> tuple[Analysis, dict[str, Effect]]:
    """A new analysis of recordings simulated from the accepted fit, and the effects in them."""
    noise = noise_like(accepted(a), rng)
    beside = noise_like(a.proof[2], rng) if a.proof else []
    fit, held_out = drawn(a, rng)
    if not with_effects:
        fit, held_out = bare(fit, held_out)
    training = replicated(fit.model, fit.point, noise, a.training.records)
    proof = []
    if held_out is not None and a.held_out is not None:
        proof = replicated(held_out.model, held_out.point, beside, a.held_out.records)
    return begin(a.system, training, proof), simulated_effects(fit)
