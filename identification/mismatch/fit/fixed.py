"""Numbers that calibration moved far from the file, fixed where the file has them.

They may make up for an effect. Beside them it leaves no trace: of a backlash worth 500 nats a
screening saw 0.1. With them fixed, and all others fitted, what they made up for is left over.
"""

from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.calibrate import (
    map_fit,
    parameters_far_from_prior,
    start_fit,
)
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.following import (
    ROUGHLY,
    refit_with_updated_jacobian,
    relinearized,
)
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.simulation.model import Model, Point, predict


def far_numbers_fixed(fit: Fit) -> Fit:
    """Return the fit of all other numbers and of the effects, begun at the numbers of the file.

    Raises PlantError where it cannot run.
    """
    far = {known for known, _ in parameters_far_from_prior(fit)}
    left = [k for k in fit.model.known if k not in far]
    clocks = {k: x for k, x in zip(fit.model.known, fit.point.x, strict=True) if k.of_clock}
    model = fit.model.uncertain_of(left)
    x = np.array([clocks.get(k, 0.0) for k in left])
    uncalibrated = replace(start_fit(model, replace(fit.point, x=x)), candidates=fit.candidates)
    return refit_with_updated_jacobian(optimize(uncalibrated), ROUGHLY)


def freed(fit: Fit, model: Model) -> Fit:
    """Return the fit with everything that a model is uncertain of fitted again.

    Raises PlantError where it cannot run.
    """
    there = dict(zip(fit.model.known, fit.point.x, strict=True))
    x = np.array([there.get(k, 0.0) for k in model.known])
    point: Point = replace(fit.point, x=x)
    start = Fit(model, point, predict(model, point), fit.noise, [], fit.candidates)
    return map_fit(relinearized(start))
