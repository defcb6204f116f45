"""Calibration: MAP estimation of the vehicle's own parameters within their priors."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit, whitened_as
from slipbench.identification.mismatch.fit.least_squares_start import (
    from_its_beginning,
    least_squares_start,
    other_minimum,
)
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.refit import ROUGHLY, refit_with_updated_jacobian
from slipbench.identification.mismatch.fit.sensitivity import sensitivities
from slipbench.identification.mismatch.fit.stack import residuals, whiten_and_stack, whiteners
from slipbench.identification.mismatch.fit.whitening import Whitener, even, scale_of
from slipbench.identification.mismatch.simulation.coordinates import Coordinate
from slipbench.identification.mismatch.simulation.model import Model, Point, Series, predict
from slipbench.identification.mismatch.thresholds import (
    BEYOND_PRIOR,
    FAR_FROM_PRIOR,
    HIDDEN_BY_NOISE,
)
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

AT_THE_END = 0.99
"""Share of the largest allowed deviation of a parameter beyond which it counts as at its bound."""


def calibrate(model: Model, start: Point) -> Fit:
    """Calibrate the vehicle, the slow disturbance and the noise model by MAP.

    No effects act except those of the start. If the estimate is far from the prior, or the noise
    model predicts nearly all of the error, the calibration is repeated by plain least squares on
    growing initial parts of the recordings (see fit/least_squares_start.py), and the better fit is kept. Only the
    last refit uses fine simulation steps.
    """
    uncalibrated = start_fit(model.coarse, start)
    fit = refit_with_updated_jacobian(optimize(uncalibrated), ROUGHLY)
    if far_from_prior(fit) or hidden_by_noise(fit):
        score = fit.score
        fit = _better_of(lambda: least_squares_start(from_its_beginning(uncalibrated), score), fit)
    return refit_with_updated_jacobian(fit.fine(model))


def map_fit(start: Fit) -> Fit:
    """Return the MAP fit reached from a start."""
    return refined(optimize(start))


def from_another_start(start: Fit) -> Fit:
    """Return the fit reached from a start that is an alternative to others; no further one."""
    return refit_with_updated_jacobian(optimize(start), ROUGHLY)


def refined(fit: Fit) -> Fit:
    """Return the best fit reached from one optimized with the sensitivities of another point.

    If the noise model predicts nearly all of the error, plain least squares is tried as well: see
    `other_minimum`.
    """
    new = refit_with_updated_jacobian(fit, ROUGHLY)
    if not hidden_by_noise(new):
        return new
    return _better_of(lambda: other_minimum(fit, new), new)


def _better_of(alternative: Callable[[], Fit], fit: Fit) -> Fit:
    """Return the better of two fits; `fit` where the alternative cannot be simulated."""
    try:
        return max(fit, alternative(), key=lambda f: f.score)
    except PlantError:
        return fit


def hidden_by_noise(fit: Fit) -> bool:
    """Return whether the noise model predicts nearly all of the error."""
    return taken_for_noise(fit) >= HIDDEN_BY_NOISE


def start_fit(model: Model, start: Point) -> Fit:
    """Return the start compared with the recordings; only the noise model is fitted."""
    predicted = predict(model, start)
    slopes = sensitivities(model, start)
    return Fit(model, start, predicted, _first_noise(model, predicted, slopes), slopes)


def taken_for_noise(fit: Fit) -> float:
    """Share of the mean square error that the noise model predicts from the preceding errors.

    The largest share over the output groups.
    """
    shares = []
    for noise, errors_of_group in zip(fit.noise, fit.residuals, strict=True):
        log_mean_squares = np.log(np.mean(np.concatenate(errors_of_group) ** 2, axis=0) + 1e-300)
        shares.append(
            1.0
            - np.exp(
                noise.log_innovations / log_mean_squares.size - float(np.mean(log_mean_squares))
            )
        )
    return float(max(shares))


def beyond_prior(fit: Fit, limit: float = BEYOND_PRIOR) -> bool:
    """Return whether calibration moved a parameter farther from its prior than `limit` deviations.

    The parameter may then compensate for a missing effect. If the effect is added, the parameter
    stays where it is: values between that one and the true one fit neither with nor without the
    effect.
    """
    return bool(parameters_far_from_prior(fit, limit))


def parameters_far_from_prior(
    fit: Fit, limit: float = FAR_FROM_PRIOR
) -> list[tuple[Coordinate, float]]:
    """Return parameters beyond `limit` prior deviations, with their deviations."""
    known = zip(fit.model.known, fit.point.x, strict=True)
    bound = min(limit, AT_THE_END * fit.model.system.coordinate_bound)
    return [(k, float(x)) for k, x in known if abs(x) > bound and not k.of_clock]


def far_from_prior(fit: Fit) -> bool:
    """Return whether a parameter is so far away that it must compensate for a missing effect."""
    return beyond_prior(fit, FAR_FROM_PRIOR)


def at_prior_mean(fit: Fit) -> Fit:
    """Return the fit with the system's parameters at their prior mean.

    Clocks and slow disturbance keep their estimates. Raises PlantError where it cannot be
    simulated.
    """
    x = np.where([k.of_clock for k in fit.model.known], fit.point.x, 0.0)
    point = replace(fit.point, x=x)
    new = replace(fit, point=point, predicted=predict(fit.model, point), slopes_at=fit.taken_at)
    return whitened_as(fit, new)


def _first_noise(model: Model, predicted: Series, slopes: Series) -> list[Whitener]:
    """Fit noise models to the residual of plain least squares, free of calibration errors."""
    residual = residuals(model, predicted)
    scales = [even(scale_of(r)) for r in residual]
    columns, target = (
        whiten_and_stack(model, scales, slopes),
        whiten_and_stack(model, scales, residual),
    )
    normal = columns.T @ columns + np.eye(columns.shape[1])
    remaining = target - columns @ np.linalg.solve(normal, columns.T @ target)
    return whiteners(model, _unstacked(model, scales, remaining))


def _unstacked(model: Model, noise: Sequence[Whitener], rows: Floats) -> Series:
    series: Series = []
    row = 0
    for scales, measured in zip(noise, model.measured, strict=True):
        group = []
        for m in measured:
            group.append(rows[row : row + m.size].reshape(m.shape) / np.diag(scales.inverse))
            row += m.size
        series.append(group)
    return series
