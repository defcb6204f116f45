"""Plain least-squares fits from distant starts, where a noise model would prevent convergence."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit, renoised
from slipbench.identification.mismatch.fit.optimize import at_fixed_noise
from slipbench.identification.mismatch.fit.refit import (
    ROUGHLY,
    refit_with_updated_jacobian,
    relinearized,
)
from slipbench.identification.mismatch.fit.whitening import even, scale_of
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.plant.signals import Floats

ROUNDS = 6
BEGINNINGS = (1 / 64, 1 / 16, 1 / 4)
"""Shares of a recording, from its beginning, that are fitted one after the other."""
LEAST = 1e-3
"""Share of the error over the whole recordings below which an error of an initial part is
negligible."""
OTHER = 0.5
"""Share of the mean square of a known fit below which plain least squares has found another
minimum."""
BETTER = 0.1
"""Share of the mean square by which a round of plain least squares must lower it: on the way to
another minimum errors fall by factors."""


def least_squares_start(fit: Fit, rival: float = -np.inf) -> Fit:
    """Return the fit reached by plain least squares and then refitted with a noise model.

    A noise model attributes the errors of a wrong simulation to noise, and the fit then stays near
    its start; unweighted errors do not hold it there. rival: score of a known fit, see
    `refit_with_updated_jacobian`.
    """
    start = renoised(_least_squares(fit, ROUNDS, _negligible_errors(fit)))
    return refit_with_updated_jacobian(start, ROUGHLY, rival)


def other_minimum(fit: Fit, known: Fit) -> Fit:
    """Return the fit reached by plain least squares, if that may be another minimum than a known one.

    In the same minimum the plain error of the known fit is little larger than the least.
    """
    plain = _least_squares(fit, ROUNDS, _negligible_errors(fit))
    if _mean_square(plain.residuals) > OTHER * _mean_square(known.residuals):
        return known
    return refit_with_updated_jacobian(renoised(plain), ROUGHLY, known.score)


def from_its_beginning(start: Fit) -> Fit:
    """Return the plain least-squares fit to growing initial parts of each recording.

    An error of the initial states or of a frequency grows with time. Where it exceeds half a
    period, the gradient leads to a neighbouring period.
    """
    fit = start
    for share in BEGINNINGS:
        fit = _least_squares(
            replace(fit, model=start.model.until(share)), 2, _negligible_errors(start)
        )
    return replace(fit, model=start.model)


def _negligible_errors(fit: Fit) -> list[Floats]:
    """Return the negligible error of each output, by output group, over the whole recordings."""
    return [LEAST * scale_of(r) for r in fit.residuals]


def _least_squares(fit: Fit, rounds: int, negligible: Sequence[Floats]) -> Fit:
    """Iterate plain least squares while the error falls. negligible: see `_negligible_errors`."""
    error = np.inf
    for _ in range(rounds):
        noise = [
            even(np.maximum(scale_of(r), s)) for r, s in zip(fit.residuals, negligible, strict=True)
        ]
        fit = at_fixed_noise(relinearized(replace(fit, noise=noise)))
        previous, error = error, _mean_square(fit.residuals)
        if error > (1.0 - BETTER) * previous:
            break
    return fit


def _mean_square(residuals: Series) -> float:
    """Geometric mean over the output groups, which have different units."""
    return float(
        np.exp(np.mean([np.log(np.mean(np.concatenate(r) ** 2) + 1e-300) for r in residuals]))
    )
