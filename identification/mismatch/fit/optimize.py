"""Gauss-Newton fit of vehicle, slow disturbance and effects together, with a refitted noise model.

Sensitivities to the vehicle are kept over many steps, because they change little; those to the
effect parameters are updated at each step.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from slipbench.identification.mismatch.fit.fitting import Fit, parameters, renoised, whitened_as
from slipbench.identification.mismatch.fit.hypothesis import Hypothesis
from slipbench.identification.mismatch.fit.resolution import strengths_of
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of, moved
from slipbench.identification.mismatch.fit.slopes import Slopes
from slipbench.identification.mismatch.fit.stack import bounded
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

SETTLED = 0.5  # nats; gain required for another step
UNFINISHED = 0.05
"""Share of the gain of an optimization with refitted noise below which a step is left to the next.

Each one that gains much is followed by another, with updated sensitivities; so the last one ends at
SETTLED (inexact inner iterations: Dembo, Eisenstat and Steihaug, "Inexact Newton methods", SIAM
Journal on Numerical Analysis 19 (1982)). At a fixed noise model nothing is left: the refitted one
might take it for noise."""
SHARES = (1.0, 0.4, 0.1)
REACH = 2.0
"""Largest step of a system parameter, in prior deviations: the linearization holds no farther."""
DAMPINGS = (0.01, 0.1, 1.0)
STEPS = 5  # at a fixed noise model
STEPS_ALONG = 8


def optimize(start: Fit) -> Fit:
    """Fit to convergence: at the noise model of the start, then with the noise model refitted.

    Where the first part lowers the score, which counts the noise model, the second one begins at
    the start.
    """
    best = max(start, renoised(at_fixed_noise(start)), key=lambda f: f.score)
    return _iterated(best, STEPS_ALONG, refit_noise=True)


def at_fixed_noise(start: Fit, steps: int = STEPS) -> Fit:
    """Fit at the noise model and the sensitivities of the start."""
    return _iterated(start, steps, refit_noise=False)


def _iterated(start: Fit, steps: int, refit_noise: bool) -> Fit:
    fit, damping_index = start, 0
    share = UNFINISHED if refit_noise else 0.0
    for _ in range(steps):
        worth = max(SETTLED, share * (fit.score - start.score))
        new, damping_index = _step(fit, refit_noise, damping_index, worth)
        if new.score - fit.score < worth:
            return new
        fit = new
    return fit


def _step(fit: Fit, refit_noise: bool, damping_index: int, worth: float) -> tuple[Fit, int]:
    """Return the fit after the first full, shortened or damped step that improves it, else `fit`.

    If a step improves one subsystem and worsens another, only its components of the first are
    taken. damping_index: index of the last successful step; the search begins one step before it.
    worth: predicted gain below which a step is not tried, nats.
    """
    slopes = Slopes.of(fit, refit_noise)
    full = _full_step(fit, slopes)
    if slopes.gain(full) < worth:
        return fit, damping_index
    first = max(damping_index - 1, 0)
    for i, step in enumerate(islice(_steps(fit, full, slopes), first, None), start=first):
        new = _better(fit, step, refit_noise) if slopes.gain(step) >= worth else None
        if new is not None:
            return new, i
    return fit, damping_index


def _better(fit: Fit, step: Floats, refit_noise: bool) -> Fit | None:
    """Return the fit after a step, or after its beneficial part; None where neither improves."""
    count = coordinates_of(fit.point).size
    stepped = after_step(fit, step[:count], step[count:])
    if stepped is None:
        return None
    new = renoised(stepped) if refit_noise else stepped
    if new.score > fit.score:
        return new
    part = _part_that_helped(fit, stepped, step)
    if part is None:
        return None
    new = renoised(part) if refit_noise else part
    return new if new.score > fit.score + SETTLED else None


def _full_step(fit: Fit, slopes: Slopes) -> Floats:
    """Return the bounded least-squares step; coordinates, then effect parameters."""
    z, u = coordinates_of(fit.point), parameters(fit.candidates)
    low, high = limits_of(fit, z)
    now, unlimited = np.concatenate((z, u)), np.full(u.size, np.inf)
    low, high = np.concatenate((low, -unlimited)), np.concatenate((high, unlimited))
    return bounded(slopes.normal, slopes.slope + slopes.normal @ now, low, high) - now


def _steps(fit: Fit, full: Floats, slopes: Slopes) -> Iterator[Floats]:
    """Yield shares of the full step, then Levenberg-Marquardt steps of increasing damping."""
    yield from (share * full for share in SHARES)
    z = coordinates_of(fit.point)
    low, high = limits_of(fit, z)
    for damping in DAMPINGS:
        damped = slopes.normal + damping * np.diag(np.diag(slopes.normal))
        step = np.asarray(np.linalg.solve(damped, slopes.slope), np.float64)
        step[: z.size] = np.clip(step[: z.size], low - z, high - z)
        yield step


def _part_that_helped(fit: Fit, new: Fit, step: Floats) -> Fit | None:
    """Return the part of a step that concerns only improved subsystems; None if none or all."""
    before, after = _squares_by_subsystem(fit), _squares_by_subsystem(new)
    improved = {d for d in before if after[d] < before[d]}
    total_gain = sum(before[d] - after[d] for d in improved)
    if total_gain < 2 * SETTLED or len(improved) == len(before):
        return None
    own = np.array([improved.issuperset(subsystems) for subsystems in _subsystems(fit)])
    part = np.where(own, step, 0.0)
    count = coordinates_of(fit.point).size
    return after_step(fit, part[:count], part[count:]) if part.any() else None


def _squares_by_subsystem(fit: Fit) -> dict[str, float]:
    """Sum of squared whitened residuals of each subsystem's outputs."""
    squares = dict.fromkeys(fit.model.partition.subsystems, 0.0)
    first = 0
    for group, residuals in zip(fit.model.partition.groups, fit.residuals, strict=True):
        rows = sum(r.size for r in residuals)
        squares[group.subsystem] += float(np.sum(fit.whitened_residuals[first : first + rows] ** 2))
        first += rows
    return squares


def _subsystems(fit: Fit) -> list[tuple[str, ...]]:
    """Subsystems that each coordinate and each effect parameter can change."""
    system, partition = fit.model.system, fit.model.partition
    subsystems = [system.affected_subsystems(partition, c) for c in fit.model.known]
    subsystems += [system.slow_subsystems(partition)] * sum(q.size for q in fit.point.q)
    for candidate, effect in zip(fit.candidates, fit.point.effects, strict=False):
        subsystems += [fit.model.subsystems_changed_by(effect)] * len(candidate.parameters)
    return subsystems


def limits_of(fit: Fit, z: Floats, step: float = REACH) -> tuple[Floats, Floats]:
    """Return bounds of the coordinates for a step, (p,) each; the slow disturbance has none."""
    own = np.arange(z.size) < len(fit.point.x)
    far = fit.model.system.coordinate_bound
    low = np.maximum(z - step, np.minimum(-far, z))
    high = np.minimum(z + step, np.maximum(far, z))
    return np.where(own, low, -np.inf), np.where(own, high, np.inf)


def after_step(fit: Fit, dz: Floats, du: Floats) -> Fit | None:
    """Return the fit after a step, (p,) each; None where it cannot be simulated."""
    candidates = turned(fit.candidates, du)
    effects = tuple(c.effect() for c in candidates) if candidates else fit.point.effects
    point = replace(moved(fit.model, fit.point, dz), effects=effects)
    try:
        predicted = predict(fit.model, point)
    except PlantError:
        return None
    measured = "effect_columns" in fit.__dict__
    strengths = strengths_of(fit.effect_columns) if measured else fit.strengths
    new = replace(
        fit,
        point=point,
        predicted=predicted,
        candidates=candidates,
        strengths=strengths,
        slopes_at=fit.taken_at,
    )
    return whitened_as(fit, new)


def turned(now: Sequence[Hypothesis], step: Floats) -> tuple[Hypothesis, ...]:
    """Return the candidates after a step of their parameters, shape (parameters,)."""
    if not now:
        return ()
    places = np.cumsum([len(c.parameters) for c in now])[:-1]
    return tuple(c.moved(s) for c, s in zip(now, np.split(step, places), strict=True))
