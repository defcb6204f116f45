"""Re-calibration: the vehicle's own numbers move, as far as they were believed, to fit the data."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.far import from_its_beginning, least_squares_start
from slipbench.identification.mismatch.fit.fitting import Fit, whitened_as
from slipbench.identification.mismatch.fit.following import ROUGHLY, refit_with_updated_jacobian
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.sensitivity import sensitivities
from slipbench.identification.mismatch.fit.stack import residuals, whiten_and_stack, whiteners
from slipbench.identification.mismatch.fit.whitening import Whitener, even, scale_of
from slipbench.identification.mismatch.simulation.coordinates import Coordinate
from slipbench.identification.mismatch.simulation.model import Model, Point, Series, predict
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

STRAYED = 2.0
"""Prior deviations beyond which something that is missing may have moved a number.

Of ten that err as believed one is farther in 37 of 100: that costs one more start of a fit.
"""
ASTRAY = 3.0
"""Prior deviations beyond which calibration itself may have lost its way; by chance in 3 of 100."""
AT_THE_END = 0.99
"""Share of the farthest that a number may be off at all, beyond which it is held there."""
TAKEN = 0.9
"""Share of the mean square error above which a noise model may hide a wrong simulation."""


def calibrate(model: Model, start: Point) -> Fit:
    """Fit the vehicle, the slow road and the noise; no effects but those of the start.

    Where that leads far away it is tried once more by plain least squares, from the beginning of the
    recordings on: see fit/far.py. The way there is simulated with coarse steps.
    """
    uncalibrated = start_fit(model.coarse, start)
    fit = refit_with_updated_jacobian(optimize(uncalibrated), ROUGHLY)
    if far_from_prior(fit) or hidden_by_noise(fit):
        fit = _or_by(lambda: least_squares_start(from_its_beginning(uncalibrated)), fit)
    return refit_with_updated_jacobian(fit.fine(model))


def map_fit(start: Fit) -> Fit:
    """Return the best fit that is reached from a start."""
    return refined(optimize(start))


def refined(fit: Fit) -> Fit:
    """Return the best fit that is reached from one that settled with sensitivities of another.

    Where the noise model takes nearly all of the error for noise, plain least squares is tried as
    well: see `least_squares_start`.
    """
    new = refit_with_updated_jacobian(fit, ROUGHLY)
    return _or_by(lambda: least_squares_start(fit), new) if hidden_by_noise(new) else new


def _or_by(way: Callable[[], Fit], fit: Fit) -> Fit:
    """Return a fit, or what another way leads to where that is better."""
    try:
        return max(fit, way(), key=lambda f: f.score)
    except PlantError:
        return fit


def hidden_by_noise(fit: Fit) -> bool:
    """Tell whether the noise model takes nearly all of the error for noise."""
    return taken_for_noise(fit) >= TAKEN


def start_fit(model: Model, start: Point) -> Fit:
    """Return the start beside the recordings; nothing but the noise is fitted."""
    predicted = predict(model, start)
    slopes = sensitivities(model, start)
    return Fit(model, start, predicted, _first_noise(model, predicted, slopes), slopes)


def taken_for_noise(fit: Fit) -> float:
    """Share of the mean square error that the noise model predicts from the errors before it.

    Of the outputs of one block, of the block with the largest share.
    """
    shares = []
    for white, rest in zip(fit.noise, fit.residuals, strict=True):
        errors = np.log(np.mean(np.concatenate(rest) ** 2, axis=0) + 1e-300)
        shares.append(1.0 - np.exp(white.log_innovations / errors.size - float(np.mean(errors))))
    return float(max(shares))


def beyond_prior(fit: Fit, far: float = STRAYED) -> bool:
    """Tell whether calibration went farther from what the file believes than it errs.

    It then makes up for something that is missing, and with that in place stays where it went:
    between there and the truth lies what fits neither with it nor without.
    """
    return bool(parameters_far_from_prior(fit, far))


def parameters_far_from_prior(fit: Fit, far: float = ASTRAY) -> list[tuple[Coordinate, float]]:
    """Return the numbers that calibration moved by more than so many prior deviations, and by how many."""
    known = zip(fit.model.known, fit.point.x, strict=True)
    end = min(far, AT_THE_END * fit.model.system.farthest)
    return [(k, float(x)) for k, x in known if abs(x) > end and not k.of_clock]


def far_from_prior(fit: Fit) -> bool:
    """Tell whether calibration went so far that it must have made up for something missing."""
    return beyond_prior(fit, ASTRAY)


def at_prior_mean(fit: Fit) -> Fit:
    """Return the fit with the system's numbers as its file tells them; clocks and road are kept.

    Raises PlantError where it cannot run.
    """
    x = np.where([k.of_clock for k in fit.model.known], fit.point.x, 0.0)
    point = replace(fit.point, x=x)
    new = replace(fit, point=point, predicted=predict(fit.model, point), slopes_at=fit.taken_at)
    return whitened_as(fit, new)


def _first_noise(model: Model, predicted: Series, slopes: Series) -> list[Whitener]:
    """Fit noise models to what plain least squares leaves, so that calibration is not noise."""
    rest = residuals(model, predicted)
    white = [even(scale_of(r)) for r in rest]
    columns, aim = whiten_and_stack(model, white, slopes), whiten_and_stack(model, white, rest)
    normal = columns.T @ columns + np.eye(columns.shape[1])
    left = aim - columns @ np.linalg.solve(normal, columns.T @ aim)
    return whiteners(model, _unflat(model, white, left))


def _unflat(model: Model, plain: Sequence[Whitener], rows: Floats) -> Series:
    found: Series = []
    place = 0
    for white, ms in zip(plain, model.measured, strict=True):
        block = []
        for m in ms:
            block.append(rows[place : place + m.size].reshape(m.shape) / np.diag(white.inverse))
            place += m.size
        found.append(block)
    return found
