"""Re-calibration: the vehicle's own numbers move, as far as they were believed, to fit the data."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit, dials, renoised
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of, sensitivities
from slipbench.identification.mismatch.fit.settling import limits_of, promised, settle, there
from slipbench.identification.mismatch.fit.stack import flat, residuals, whiteners
from slipbench.identification.mismatch.fit.whitening import Whitener
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
FARTHEST = 64.0
"""Times the last way, at most, that a fit is looked for along it."""
WORTH_AGAIN = 10.0  # nats; what is left then is far less, since steps converge quadratically


def calibrate(model: Model, start: Point) -> Fit:
    """Fit the vehicle, the slow road and the noise; no effects but those of the start.

    Where that leads far away it is tried once more by plain least squares: see `from_far`.
    """
    told = as_told(model, start)
    fit = followed(settle(told, noises=3))
    if model.system.by_factors or not strayed(fit, ASTRAY):
        return fit
    try:
        return max(fit, from_far(told), key=lambda f: f.score)
    except PlantError:
        return fit


def as_told(model: Model, start: Point) -> Fit:
    """Return the start beside the recordings; nothing but the noise is fitted."""
    predicted = predict(model, start)
    slopes = sensitivities(model, start)
    return Fit(model, start, predicted, _first_noise(model, predicted, slopes), slopes)


def followed(fit: Fit) -> Fit:
    """Return the fit settled with sensitivities taken anew, again as long as that brings much.

    Numbers known to a few per cent bend nothing; those of a model file may move by factors.
    """
    fit = settle(refreshed(fit))
    for _ in range(fit.model.system.bends):
        new = farther_along(fit, settle(refreshed(fit)))
        if new.score - fit.score < WORTH_AGAIN:
            return unbent(max(new, fit, key=lambda f: f.score))
        fit = new
    return fit


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


def unbent(fit: Fit, rounds: int = 1) -> Fit:
    """Return a settled fit, settled again where its sensitivities promise much more.

    They are of a point nearby, and where a tyre nears its peak they change within little. rounds:
    how often at most; sensitivities are what costs most.
    """
    for _ in range(rounds):
        if promised(fit) < WORTH_AGAIN:
            break
        new = settle(refreshed(fit))
        gain, fit = new.score - fit.score, max(new, fit, key=lambda f: f.score)
        if gain < WORTH_AGAIN:
            break
    return fit


def from_far(fit: Fit) -> Fit:
    """Return the fit by plain least squares, taken up from there with a noise model.

    A noise model takes a wrong simulation's errors for noise, and fits then stay where they begin;
    plain errors lead from far.
    """
    error = np.inf
    for _ in range(ROUNDS):
        fit = settle(refreshed(replace(fit, noise=[_plain(r) for r in fit.rest])), noises=1)
        before, error = error, _mean_square(fit.rest)
        if error > (1.0 - BETTER) * before:
            break
    return followed(fit)


def strayed(fit: Fit, far: float = STRAYED) -> bool:
    """Tell whether calibration went farther from what the file believes than it errs.

    It then makes up for something that is missing, and with that in place stays where it went:
    between there and the truth lies what fits neither with it nor without.
    """
    known = zip(fit.point.x, fit.model.known, strict=True)
    return any(abs(x) > far for x, k in known if not k.of_clock)


def astray(fit: Fit) -> bool:
    """Tell whether calibration went so far that it must have made up for something missing."""
    return strayed(fit, ASTRAY) and not fit.model.system.by_factors


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
    return replace(fit, slopes=sensitivities(fit.model, fit.point))


def partly_refreshed(fit: Fit) -> Fit:
    """Return the same with sensitivities taken anew where that costs little.

    Those are drives without a slow unknown; only such as the fit's effects concern are looked at.
    """
    system, chain = fit.model.system, fit.model.chain
    cheap = frozenset(
        d
        for d in chain.drives
        if d not in system.slow_drives(chain)
        and any(d in fit.model.concerned(e) for e in fit.point.effects)
    )
    if not cheap:
        return fit
    return replace(fit, slopes=sensitivities(fit.model, fit.point, fit.slopes, cheap))


def _first_noise(model: Model, predicted: Series, slopes: Series) -> list[Whitener]:
    """Fit noise models to what plain least squares leaves, so that calibration is not noise."""
    rest = residuals(model, predicted)
    plain = [_plain(r) for r in rest]
    columns, aim = flat(model, plain, slopes), flat(model, plain, rest)
    normal = columns.T @ columns + np.eye(columns.shape[1])
    left = aim - columns @ np.linalg.solve(normal, columns.T @ aim)
    return whiteners(model, _unflat(model, plain, left))


def _plain(rest: Sequence[Floats]) -> Whitener:
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
