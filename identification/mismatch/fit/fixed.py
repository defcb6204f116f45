"""Parameters that calibration moved far from the file, fixed at the values of the file.

Such parameters may compensate for a missing effect. In a fit with them free the effect has almost
no response: a screening found a log-likelihood gain of 0.1 nats for a backlash worth 500 nats. With
them fixed and all others fitted, the residual contains what they compensated for.
"""

from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.calibrate import (
    from_another_start,
    parameters_far_from_prior,
    start_fit,
)
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.refit import relinearized
from slipbench.identification.mismatch.simulation.model import Model, Point, predict


def far_numbers_fixed(fit: Fit) -> Fit:
    """Return the fit of all other parameters and the effects, started at the values of the file.

    Raises PlantError where it cannot be simulated.
    """
    far = {known for known, _ in parameters_far_from_prior(fit)}
    remaining = [k for k in fit.model.known if k not in far]
    clocks = {k: x for k, x in zip(fit.model.known, fit.point.x, strict=True) if k.of_clock}
    model = fit.model.uncertain_of(remaining)
    x = np.array([clocks.get(k, 0.0) for k in remaining])
    uncalibrated = replace(start_fit(model, replace(fit.point, x=x)), candidates=fit.candidates)
    return from_another_start(uncalibrated)


def freed(fit: Fit, model: Model) -> Fit:
    """Return the fit with all uncertain parameters of a model fitted again.

    Raises PlantError where it cannot be simulated.
    """
    estimates = dict(zip(fit.model.known, fit.point.x, strict=True))
    x = np.array([estimates.get(k, 0.0) for k in model.known])
    point: Point = replace(fit.point, x=x)
    start = Fit(model, point, predict(model, point), fit.noise, [], fit.candidates)
    return from_another_start(relinearized(start))
