"""Gauss-Newton with the noise model fitted along: vehicle, slow road and effects move together.

Sensitivities to the vehicle are kept over many steps (they change little), those to the effects'
dials are taken anew at each.
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

SETTLED = 0.5  # nats that another step must bring
SHARES = (1.0, 0.4, 0.1)
REACH = 2.0
"""Prior deviations that a number of the system may move in a step: slopes hold no farther."""
DAMPINGS = (0.01, 0.1, 1.0)
STEPS = 5  # under one noise model
STEPS_ALONG = 8


def optimize(start: Fit) -> Fit:
    """Fit until nothing moves: under the noise model of the start, then with it fitted along."""
    return _climbed(renoised(at_fixed_noise(start)), STEPS_ALONG, along=True)


def at_fixed_noise(start: Fit, steps: int = STEPS) -> Fit:
    """Fit under the noise model of the start, as far as these slopes lead."""
    return _climbed(start, steps, along=False)


def _climbed(fit: Fit, steps: int, along: bool) -> Fit:
    damping_index = 0
    for _ in range(steps):
        new, damping_index = _step(fit, along, damping_index)
        if new.score - fit.score < SETTLED:
            return new
        fit = new
    return fit


def _step(fit: Fit, along: bool, damping_index: int) -> tuple[Fit, int]:
    """Return the first of a full, shorter and damped steps that leads on, or the same fit.

    Where a step helps one drive and harms another, only what concerns the first is taken.
    held_back: which of the steps led on before; it and the one before it are where this one begins.
    """
    slopes = Slopes.of(fit, along)
    full = _full_step(fit, slopes)
    if float(slopes.slope @ full) < 2 * SETTLED:
        return fit, damping_index
    first = max(damping_index - 1, 0)
    for i, step in enumerate(islice(_steps(fit, full, slopes), first, None), start=first):
        new = _better(fit, step, along)
        if new is not None:
            return new, i
    return fit, damping_index


def _better(fit: Fit, step: Floats, along: bool) -> Fit | None:
    """Return what a step leads to, or the part of it that helps; None where it does not lead on."""
    places = coordinates_of(fit.point).size
    bare = there(fit, step[:places], step[places:])
    if bare is None:
        return None
    new = renoised(bare) if along else bare
    if new.score > fit.score:
        return new
    part = _part_that_helped(fit, bare, step)
    if part is None:
        return None
    new = renoised(part) if along else part
    return new if new.score > fit.score + SETTLED else None


def _full_step(fit: Fit, slopes: Slopes) -> Floats:
    """Return the step to where least squares leads, within bounds; coordinates, then dials."""
    z, u = coordinates_of(fit.point), parameters(fit.candidates)
    low, high = limits_of(fit, z)
    now, far = np.concatenate((z, u)), np.full(u.size, np.inf)
    low, high = np.concatenate((low, -far)), np.concatenate((high, far))
    return bounded(slopes.normal, slopes.slope + slopes.normal @ now, low, high) - now


def _steps(fit: Fit, full: Floats, slopes: Slopes) -> Iterator[Floats]:
    """Yield shares of a full step; then Marquardt's, which hold back where little is known."""
    yield from (share * full for share in SHARES)
    z = coordinates_of(fit.point)
    low, high = limits_of(fit, z)
    for damping in DAMPINGS:
        held = slopes.normal + damping * np.diag(np.diag(slopes.normal))
        step = np.asarray(np.linalg.solve(held, slopes.slope), np.float64)
        step[: z.size] = np.clip(step[: z.size], low - z, high - z)
        yield step


def _part_that_helped(fit: Fit, new: Fit, step: Floats) -> Fit | None:
    """Return the part of a step that concerns only drives which it helped; None: none or all."""
    before, after = _by_subsystem(fit), _by_subsystem(new)
    helped = {d for d in before if after[d] < before[d]}
    gained = sum(before[d] - after[d] for d in helped)
    if gained < 2 * SETTLED or len(helped) == len(before):
        return None
    own = np.array([helped.issuperset(subsystems) for subsystems in _subsystems(fit)])
    part = np.where(own, step, 0.0)
    places = coordinates_of(fit.point).size
    return there(fit, part[:places], part[places:]) if part.any() else None


def _by_subsystem(fit: Fit) -> dict[str, float]:
    """Sum of the squares of what each drive's outputs leave."""
    found = dict.fromkeys(fit.model.partition.subsystems, 0.0)
    first = 0
    for block, rest in zip(fit.model.partition.groups, fit.residuals, strict=True):
        rows = sum(r.size for r in rest)
        found[block.subsystem] += float(np.sum(fit.whitened_residuals[first : first + rows] ** 2))
        first += rows
    return found


def _subsystems(fit: Fit) -> list[tuple[str, ...]]:
    """Drives that each coordinate and each dial can change."""
    system, partition = fit.model.system, fit.model.partition
    found = [system.touched(partition, c) for c in fit.model.known]
    found += [system.slow_subsystems(partition)] * sum(q.size for q in fit.point.q)
    for candidate, effect in zip(fit.candidates, fit.point.effects, strict=False):
        found += [fit.model.subsystems_changed_by(effect)] * len(candidate.parameters)
    return found


def limits_of(fit: Fit, z: Floats, step: float = REACH) -> tuple[Floats, Floats]:
    """Between what a step may move the coordinates to: the system's are held, the slow are free."""
    own = np.arange(z.size) < len(fit.point.x)
    far = fit.model.system.farthest
    low = np.maximum(z - step, np.minimum(-far, z))
    high = np.minimum(z + step, np.maximum(far, z))
    return np.where(own, low, -np.inf), np.where(own, high, np.inf)


def there(fit: Fit, dz: Floats, du: Floats) -> Fit | None:
    """Return the fit after a step of coordinates and dials; None where it cannot be simulated."""
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
    """Return the candidates with all their dials moved."""
    if not now:
        return ()
    places = np.cumsum([len(c.parameters) for c in now])[:-1]
    return tuple(c.moved(s) for c, s in zip(now, np.split(step, places), strict=True))
