"""Fits by plain least squares, which lead from far where a noise model holds fits where they begin."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit, renoised
from slipbench.identification.mismatch.fit.following import (
    ROUGHLY,
    refit_with_updated_jacobian,
    relinearized,
)
from slipbench.identification.mismatch.fit.optimize import at_fixed_noise
from slipbench.identification.mismatch.fit.whitening import even, scale_of
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.plant.signals import Floats

ROUNDS = 6
BEGINNINGS = (1 / 64, 1 / 16, 1 / 4)
"""Shares of a recording that are fitted one after the other on the way from far."""
LEAST = 1e-3
"""Share of the error of the whole recordings below which an error in their beginnings is none."""
BETTER = 0.02
"""Share of the mean square by which a round of plain least squares must lower it."""


def least_squares_start(fit: Fit) -> Fit:
    """Return the fit by plain least squares, taken up from there with a noise model.

    A noise model takes a wrong simulation's errors for noise, and fits then stay where they begin;
    plain errors lead from far.
    """
    return refit_with_updated_jacobian(renoised(_plainly(fit, ROUNDS, _least(fit))), ROUGHLY)


def from_its_beginning(start: Fit) -> Fit:
    """Return the fit by plain least squares to more and more of each recording.

    An error in the states in which a recording begins, or in a frequency, grows with time. Where it
    is half a turn, the slopes lead to another turn.
    """
    fit = start
    for share in BEGINNINGS:
        fit = _plainly(replace(fit, model=start.model.until(share)), 2, _least(start))
    return replace(fit, model=start.model)


def _least(fit: Fit) -> list[Floats]:
    """Return errors by block and output that count as none, of the whole recordings."""
    return [LEAST * scale_of(r) for r in fit.residuals]


def _plainly(fit: Fit, rounds: int, least: Sequence[Floats]) -> Fit:
    """Fit by plain least squares as long as that lowers the error. least: see `_least`."""
    error = np.inf
    for _ in range(rounds):
        noise = [
            even(np.maximum(scale_of(r), s)) for r, s in zip(fit.residuals, least, strict=True)
        ]
        fit = at_fixed_noise(relinearized(replace(fit, noise=noise)))
        before, error = error, _mean_square(fit.residuals)
        if error > (1.0 - BETTER) * before:
            break
    return fit


def _mean_square(rest: Series) -> float:
    """Geometric mean over the blocks, which have units of their own."""
    return float(np.exp(np.mean([np.log(np.mean(np.concatenate(r) ** 2) + 1e-300) for r in rest])))
