"""The file as it should have been: re-calibrated, with the effects that were found."""

import numpy as np

from slipbench.identification.mismatch.curves.model_spline import ModelSpline
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.stack import Nuisances
from slipbench.identification.mismatch.naming.interval import estimates, reaches
from slipbench.identification.mismatch.simulation.coordinates import NORMAL_95
from slipbench.identification.mismatch.simulation.system import System
from slipbench.plant.signals import Floats

UNTOLD = 0.95
"""Share of what was believed before, above which recordings have told nothing of a parameter."""


def improved_system(fit: Fit) -> System:
    """Return the fitted system with how well everything is known now."""
    known = dict(fit.model.system.plus_minus)
    spread = spreads(fit)
    for coordinate, x, s in zip(fit.model.known, fit.point.x, spread, strict=False):
        if not coordinate.of_clock:
            known[coordinate.key] = NORMAL_95 * float(s) * coordinate.slope(float(x))
    known |= _of_curves(fit)
    for i, candidate in enumerate(fit.candidates):
        for e in estimates(fit, i):
            if e.high > e.low:
                known[f"effects.{candidate.name}.{e.name}"] = 0.5 * (e.high - e.low)
    return fit.model.at(fit.point).as_improved(known)


def _of_curves(fit: Fit) -> dict[str, float]:
    """Half widths of the values of free curves that the file can hold, by key, SI."""
    found = dict[str, float]()
    if not any(isinstance(c, ModelSpline) for c in fit.candidates):
        return found
    first, reach = 0, reaches(fit)
    for candidate in fit.candidates:
        if isinstance(candidate, ModelSpline):
            found |= candidate.half_widths(reach[first : first + len(candidate.parameters)])
        first += len(candidate.parameters)
    return found


def spreads(fit: Fit) -> Floats:
    """Posterior deviation of every coordinate in shares of its prior one."""
    nuisances = fit.nuisances
    if fit.candidates:
        nuisances = Nuisances(np.concatenate((nuisances.columns, fit.effect_columns), axis=1))
    inverse = nuisances.fit(nuisances.columns)  # I - M^-1, since N'N = M - I
    return np.sqrt(np.clip(1.0 - np.diag(inverse), 0.0, 1.0))[: len(fit.point.x)]


def not_told(fit: Fit) -> list[str]:
    """Parameters of which these recordings say nothing."""
    return [
        c.key
        for c, s in zip(fit.model.known, spreads(fit), strict=False)
        if s > UNTOLD and not c.of_clock
    ]
