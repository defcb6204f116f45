"""Refits with updated sensitivities, with pattern moves along curved valleys."""

from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.fitting import (
    Fit,
    parameters,
    renoised,
    with_effect_slopes_of,
)
from slipbench.identification.mismatch.fit.optimize import after_step, limits_of, optimize
from slipbench.identification.mismatch.fit.resolution import strengths_of
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of, sensitivities
from slipbench.plant.signals import Floats

FARTHEST = 64.0
"""Largest multiple of the last step that is searched along its direction."""
WORTH_AGAIN = (
    1.0  # nats; far below the gain required of an effect, so that none is credited with it
)
ROUGHLY = 10.0  # nats; sufficient where fits are only compared with each other
BENDS = 20  # largest number of sensitivity updates


def refit_with_updated_jacobian(
    fit: Fit, worth: float = WORTH_AGAIN, rival: float = -np.inf
) -> Fit:
    """Return the fit optimized with updated sensitivities, repeated while the gain is large enough.

    Sensitivities hardly change with parameters known to a few per cent; other parameters move by
    factors, along curved valleys. worth: log-likelihood gain required for another round, nats.
    rival: score of a known fit; the rounds end where another gain as large as the last would not
    reach it. The first round does not count: it leaves the start, and gains most.
    """
    fit = relinearized(fit)
    for bend in range(BENDS):
        new = farther_along(fit, optimize(fit))
        gain = new.score - fit.score
        if gain < worth or (bend > 0 and new.score + gain < rival):
            return max(new, fit, key=lambda f: f.score)
        fit = relinearized(new)
    return fit


def relinearized(fit: Fit) -> Fit:
    """Return the fit with sensitivities at its own point."""
    known = bool(fit.slopes) and fit.model.system.smooth
    strengths = strengths_of(fit.nuisances.columns) if known else ()
    slopes = sensitivities(fit.model, fit.point, strengths)
    return with_effect_slopes_of(fit, replace(fit, slopes=slopes, slopes_at=None))


def farther_along(before: Fit, after: Fit) -> Fit:
    """Return the best fit on the line from one fit through the next, while the score rises.

    Along a curved valley successive fits advance slowly, each by a similar share of the distance.
    This is a pattern move (Hooke and Jeeves, "Direct search solution of numerical and statistical
    problems", Journal of the ACM 8 (1961)).
    """
    dz = coordinates_of(after.point) - coordinates_of(before.point)
    du = parameters(after.candidates) - parameters(before.candidates)
    best, factor = after, 1.0
    while factor <= FARTHEST:
        new = _shifted(after, factor * dz, factor * du)
        if new is None or new.score <= best.score:
            break
        best, factor = new, 2.0 * factor
    return best


def _shifted(fit: Fit, dz: Floats, du: Floats) -> Fit | None:
    z = coordinates_of(fit.point)
    low, high = limits_of(fit, z, np.inf)
    new = after_step(fit, np.clip(dz, low - z, high - z), du)
    return None if new is None else renoised(new)
