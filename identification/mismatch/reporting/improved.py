"""The improved system: re-calibrated, with the accepted effects."""

import numpy as np

from slipbench.identification.mismatch.curves.model_spline import ModelSpline
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.stack import Nuisances
from slipbench.identification.mismatch.naming.interval import estimates, half_widths_of
from slipbench.identification.mismatch.simulation.coordinates import NORMAL_95
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.signals import Floats

UNTOLD = 0.95
"""Ratio of posterior to prior deviation above which a parameter is not identifiable."""


def improved_system(fit: Fit) -> System:
    """Return the fitted system, with the 95 % half widths of its parameters."""
    half_widths = dict(fit.model.system.plus_minus)
    prior_shares = spreads(fit)
    for coordinate, x, share in zip(fit.model.known, fit.point.x, prior_shares, strict=False):
        if not coordinate.of_clock:
            half_widths[coordinate.key] = NORMAL_95 * float(share) * coordinate.slope(float(x))
    half_widths |= _half_widths_of_curves(fit)
    for i, candidate in enumerate(fit.candidates):
        for e in estimates(fit, i):
            if e.high > e.low:
                half_widths[f"effects.{candidate.name}.{e.name}"] = 0.5 * (e.high - e.low)
    return fit.model.at(fit.point).as_improved(half_widths)


def _half_widths_of_curves(fit: Fit) -> dict[str, float]:
    """Return the half widths of the values of free curves that the file can hold, by key, SI."""
    half_widths = dict[str, float]()
    if not any(isinstance(c, ModelSpline) for c in fit.candidates):
        return half_widths
    first, all_half_widths = 0, half_widths_of(fit)
    for candidate in fit.candidates:
        if isinstance(candidate, ModelSpline):
            half_widths |= candidate.half_widths(
                all_half_widths[first : first + len(candidate.parameters)]
            )
        first += len(candidate.parameters)
    return half_widths


def spreads(fit: Fit) -> Floats:
    """Return the ratio of posterior to prior deviation of every coordinate, (p,)."""
    nuisances = fit.nuisances
    if fit.candidates:
        nuisances = Nuisances(np.concatenate((nuisances.columns, fit.effect_columns), axis=1))
    variance_reduction = nuisances.fit(nuisances.columns)  # I - M^-1, since N'N = M - I
    return np.sqrt(np.clip(1.0 - np.diag(variance_reduction), 0.0, 1.0))[: len(fit.point.x)]


def not_told(fit: Fit) -> list[str]:
    """Return the parameters that are not identifiable from these recordings."""
    return [
        c.key
        for c, share in zip(fit.model.known, spreads(fit), strict=False)
        if share > UNTOLD and not c.of_clock
    ]
