"""Re-calibration: the vehicle's own numbers move, as far as they were believed, to fit the data."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit, dials, renoised
from slipbench.identification.mismatch.fit.resolution import strengths_of
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of, sensitivities
from slipbench.identification.mismatch.fit.settling import limits_of, settle, there
from slipbench.identification.mismatch.fit.stack import flat, residuals, whiteners
from slipbench.identification.mismatch.fit.whitening import Whitener
from slipbench.identification.mismatch.simulation.coordinates import Coordinate
from slipbench.identification.mismatch.simulation.model import Model, Point, Series, predict
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

ROUNDS = 6
BETTER = 0.02
"""Share of the mean square by which a round of plain least squares must lower it."""
STRAYED = 2.0
"""Prior deviations beyond which something that is missing may have moved a number.

Of ten that err as believed one is farther in 37 of 100: that costs one more start of a fit.
"""
ASTRAY = 3.0
"""Prior deviations beyond which calibration itself may have lost its way; by chance in 3 of 100."""
AT_THE_END = 0.99
"""Share of the farthest that a number may be off at all, beyond which it is held there."""
FARTHEST = 64.0
"""Times the last way, at most, that a fit is looked for along it."""
WORTH_AGAIN = 1.0  # nats; far less than an effect must bring, so that none gets what is left
ROUGHLY = 10.0  # nats; enough for what is only compared with other tries
BENDS = 20  # times that sensitivities are taken anew at most
TAKEN = 0.95
"""Share of the mean square error above which a noise model may hide a wrong simulation."""


def calibrate(model: Model, start: Point) -> Fit:
    """Fit the vehicle, the slow road and the noise; no effects but those of the start.

    Where that leads far away it is tried once more by plain least squares: see `from_far`. The way
    there is simulated with coarse steps.
    """
    told = as_told(model.coarse, start)
    fit = followed(settle(told, noises=3), ROUGHLY)
    best = _or_from_far(told, fit) if astray(fit) or hidden_by_noise(fit) else fit
    return followed(best.fine(model))


def settled(start: Fit) -> Fit:
    """Return the best fit that is reached from a start.

    Where the noise model takes nearly all of the error for noise, plain least squares is tried as
    well: see `from_far`.
    """
    fit = followed(settle(start), ROUGHLY)
    return _or_from_far(start, fit) if hidden_by_noise(fit) else fit


def _or_from_far(start: Fit, fit: Fit) -> Fit:
    try:
        return max(fit, from_far(start), key=lambda f: f.score)
    except PlantError:
        return fit


def hidden_by_noise(fit: Fit) -> bool:
    """Tell whether the noise model takes nearly all of the error for noise."""
    return taken_for_noise(fit) >= TAKEN


def as_told(model: Model, start: Point) -> Fit:
    """Return the start beside the recordings; nothing but the noise is fitted."""
    predicted = predict(model, start)
    slopes = sensitivities(model, start)
    return Fit(model, start, predicted, _first_noise(model, predicted, slopes), slopes)


def followed(fit: Fit, worth: float = WORTH_AGAIN) -> Fit:
    """Return the fit settled with sensitivities taken anew, again as long as that is worth it.

    Numbers known to a few per cent bend nothing; others move by factors, along curved valleys.
    worth: nats that a round must bring for another one.
    """
    fit = refreshed(fit)
    for _ in range(BENDS):
        new = farther_along(fit, settle(fit))
        if new.score - fit.score < worth:
            return max(new, fit, key=lambda f: f.score)
        fit = refreshed(new)
    return fit


def taken_for_noise(fit: Fit) -> float:
    """Share of the mean square error that the noise model predicts from the errors before it.

    Of the outputs of one block, of the block with the largest share.
    """
    shares = []
    for white, rest in zip(fit.noise, fit.rest, strict=True):
        errors = np.log(np.mean(np.concatenate(rest) ** 2, axis=0) + 1e-300)
        shares.append(1.0 - np.exp(white.log_determinant / errors.size - float(np.mean(errors))))
    return float(max(shares))


def farther_along(before: Fit, after: Fit) -> Fit:
    """Return the best fit along the line from one fit through the next, as far as it gets better.

    Along a curved valley settled fits creep, each by a like share of the way: a pattern move (Hooke
    and Jeeves, "Direct search solution of numerical and statistical problems", Journal of the ACM 8
    (1961)).
    """
    dz = coordinates_of(after.point) - coordinates_of(before.point)
    du = dials(after.candidates) - dials(before.candidates)
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


def from_far(fit: Fit) -> Fit:
    """Return the fit by plain least squares, taken up from there with a noise model.

    A noise model takes a wrong simulation's errors for noise, and fits then stay where they begin;
    plain errors lead from far.
    """
    error = np.inf
    for _ in range(ROUNDS):
        fit = settle(refreshed(replace(fit, noise=[plain(r) for r in fit.rest])), noises=1)
        before, error = error, _mean_square(fit.rest)
        if error > (1.0 - BETTER) * before:
            break
    return followed(fit, ROUGHLY)


def strayed(fit: Fit, far: float = STRAYED) -> bool:
    """Tell whether calibration went farther from what the file believes than it errs.

    It then makes up for something that is missing, and with that in place stays where it went:
    between there and the truth lies what fits neither with it nor without.
    """
    return bool(far_from_the_file(fit, far))


def far_from_the_file(fit: Fit, far: float = ASTRAY) -> list[tuple[Coordinate, float]]:
    """Return the numbers that calibration moved by more than so many prior deviations, and by how many."""
    known = zip(fit.model.known, fit.point.x, strict=True)
    end = min(far, AT_THE_END * fit.model.system.farthest)
    return [(k, float(x)) for k, x in known if abs(x) > end and not k.of_clock]


def astray(fit: Fit) -> bool:
    """Tell whether calibration went so far that it must have made up for something missing."""
    return strayed(fit, ASTRAY)


def as_believed(fit: Fit) -> Fit:
    """Return the fit with the system's numbers as its file tells them; clocks and road are kept.

    Raises PlantError where it cannot run.
    """
    x = np.where([k.of_clock for k in fit.model.known], fit.point.x, 0.0)
    point = replace(fit.point, x=x)
    new = replace(fit, point=point, predicted=predict(fit.model, point))
    new.__dict__["nuisances"] = fit.nuisances
    return new


def _mean_square(rest: Series) -> float:
    """Geometric mean over the blocks, which have units of their own."""
    return float(np.exp(np.mean([np.log(np.mean(np.concatenate(r) ** 2)) for r in rest])))


def refreshed(fit: Fit) -> Fit:
    """Return the same with sensitivities at its own point."""
    known = bool(fit.slopes) and fit.model.system.smooth
    strengths = strengths_of(fit.nuisances.columns) if known else ()
    return replace(fit, slopes=sensitivities(fit.model, fit.point, strengths))


def _first_noise(model: Model, predicted: Series, slopes: Series) -> list[Whitener]:
    """Fit noise models to what plain least squares leaves, so that calibration is not noise."""
    rest = residuals(model, predicted)
    even = [plain(r) for r in rest]
    columns, aim = flat(model, even, slopes), flat(model, even, rest)
    normal = columns.T @ columns + np.eye(columns.shape[1])
    left = aim - columns @ np.linalg.solve(normal, columns.T @ aim)
    return whiteners(model, _unflat(model, even, left))


def plain(rest: Sequence[Floats]) -> Whitener:
    """Return the noise model that takes residuals, (T, m) each, for white and not shared."""
    scale = np.sqrt(np.mean(np.concatenate(rest) ** 2, axis=0)) + 1e-12
    return Whitener(np.zeros((0, scale.size, scale.size)), np.diag(1.0 / scale))


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
