"""Settling with sensitivities taken anew, and along curved valleys."""

from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit, parameters, renoised
from slipbench.identification.mismatch.fit.optimize import limits_of, optimize, there
from slipbench.identification.mismatch.fit.resolution import strengths_of
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of, sensitivities
from slipbench.plant.signals import Floats

FARTHEST = 64.0
"""Times the last way, at most, that a fit is looked for along it."""
WORTH_AGAIN = 1.0  # nats; far less than an effect must bring, so that none gets what is left
ROUGHLY = 10.0  # nats; enough for what is only compared with other tries
BENDS = 20  # times that sensitivities are taken anew at most


def refit_with_updated_jacobian(fit: Fit, worth: float = WORTH_AGAIN) -> Fit:
    """Return the fit settled with sensitivities taken anew, again as long as that is worth it.

    Numbers known to a few per cent bend nothing; others move by factors, along curved valleys.
    worth: nats that a round must bring for another one.
    """
    fit = relinearized(fit)
    for _ in range(BENDS):
        new = farther_along(fit, optimize(fit))
        if new.score - fit.score < worth:
            return max(new, fit, key=lambda f: f.score)
        fit = relinearized(new)
    return fit


def relinearized(fit: Fit) -> Fit:
    """Return the same with sensitivities at its own point."""
    known = bool(fit.slopes) and fit.model.system.smooth
    strengths = strengths_of(fit.nuisances.columns) if known else ()
    slopes = sensitivities(fit.model, fit.point, strengths)
    return replace(fit, slopes=slopes, slopes_at=None)


def farther_along(before: Fit, after: Fit) -> Fit:
    """Return the best fit along the line from one fit through the next, as far as it gets better.

    Along a curved valley settled fits creep, each by a like share of the way: a pattern move (Hooke
    and Jeeves, "Direct search solution of numerical and statistical problems", Journal of the ACM 8
    (1961)).
    """
    dz = coordinates_of(after.point) - coordinates_of(before.point)
    du = parameters(after.candidates) - parameters(before.candidates)
    best, times = after, 1.0
    while times <= FARTHEST:
        new = _shifted(after, times * dz, times * du)
        if new is None or new.score <= best.score:
            break
        best, times = new, 2.0 * times
    return best


def _shifted(fit: Fit, dz: Floats, du: Floats) -> Fit | None:
    z = coordinates_of(fit.point)
    low, high = limits_of(fit, z, np.inf)
    new = there(fit, np.clip(dz, low - z, high - z), du)
    return None if new is None else renoised(new)
