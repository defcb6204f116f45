"""Gauss-Newton with the noise model fitted along: vehicle, slow road and effects move together.

Sensitivities to the vehicle are kept over many steps (they change little), those to the effects'
dials are taken anew at each.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from slipbench.identification.mismatch.fit.dialled import Dialled
from slipbench.identification.mismatch.fit.fitting import Fit, deviations, dials, prior, renoised
from slipbench.identification.mismatch.fit.resolution import strengths_of
from slipbench.identification.mismatch.fit.sensitivity import coordinates_of, moved
from slipbench.identification.mismatch.fit.stack import bounded
from slipbench.identification.mismatch.simulation.model import predict
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

SETTLED = 0.5  # nats that another step must bring
SHARES = (1.0, 0.4, 0.1)
REACH = 2.0
"""Prior deviations that a number of the system may move in a step: slopes hold no farther."""
DAMPINGS = (0.01, 0.1, 1.0)


def settle(start: Fit, noises: int = 4, steps: int = 5) -> Fit:
    """Fit until nothing moves; the noise model is taken anew up to `noises` times."""
    fit, score = start, -np.inf
    for _ in range(noises):
        fit = _at_fixed_noise(fit, steps)
        fit = renoised(fit)
        before, score = score, fit.score
        if score - before < SETTLED:
            break
    return fit


def _at_fixed_noise(fit: Fit, steps: int) -> Fit:
    held_back = 0
    for _ in range(steps):
        before = _objective(fit)
        new, held_back = _step(fit, before, held_back)
        if before - _objective(new) < 2 * SETTLED:
            return new
        fit = new
    return fit


def _objective(fit: Fit) -> float:
    return float(fit.aim @ fit.aim) + prior(fit.point, fit.candidates)


def _step(fit: Fit, before: float, held_back: int) -> tuple[Fit, int]:
    """Return the first of a full, shorter and damped steps that leads on, or the same fit.

    Where a step helps one drive and harms another, only what concerns the first is taken.
    held_back: which of the steps led on before; it and the one before it are where this one begins.
    """
    z, u = coordinates_of(fit.point), dials(fit.candidates)
    slope, normal = _slope(fit, z, u), _normal(fit)
    full = _full_step(fit, np.concatenate((z, u)), slope, normal)
    if float(slope @ full) < 2 * SETTLED:
        return fit, held_back
    first = max(held_back - 1, 0)
    for i, step in enumerate(islice(_steps(fit, full, slope, normal), first, None), start=first):
        new = there(fit, step[: z.size], step[z.size :])
        if new is None:
            continue
        if _objective(new) < before:
            return new, i
        part = _what_helped(fit, new, step)
        if part is not None and _objective(part) < before - 2 * SETTLED:
            return part, i
    return fit, held_back


def _full_step(fit: Fit, now: Floats, slope: Floats, normal: Floats) -> Floats:
    """Return the step to where least squares leads, within bounds; coordinates, then dials."""
    places = coordinates_of(fit.point).size
    low, high = limits_of(fit, now[:places])
    far = np.full(now.size - places, np.inf)
    low, high = np.concatenate((low, -far)), np.concatenate((high, far))
    return bounded(normal, slope + normal @ now, low, high) - now


def _normal(fit: Fit) -> Floats:
    """Normal matrix of coordinates and dials, priors included."""
    own = fit.nuisances.normal
    if not fit.candidates:
        return own
    cross = fit.nuisances.columns.T @ fit.columns
    of_dials = fit.columns.T @ fit.columns + np.diag(deviations(fit.candidates) ** -2.0)
    return np.block([[own, cross], [cross.T, of_dials]])


def _what_helped(fit: Fit, new: Fit, step: Floats) -> Fit | None:
    """Return the part of a step that concerns only drives which it helped; None: none or all."""
    before, after = _by_drive(fit), _by_drive(new)
    helped = {d for d in before if after[d] < before[d]}
    gained = sum(before[d] - after[d] for d in helped)
    if gained < 2 * SETTLED or len(helped) == len(before):
        return None
    own = np.array([helped.issuperset(drives) for drives in _drives(fit)])
    part = np.where(own, step, 0.0)
    places = coordinates_of(fit.point).size
    return there(fit, part[:places], part[places:]) if part.any() else None


def _by_drive(fit: Fit) -> dict[str, float]:
    """Sum of the squares of what each drive's outputs leave."""
    found = dict.fromkeys(fit.model.chain.drives, 0.0)
    first = 0
    for block, rest in zip(fit.model.chain.blocks, fit.rest, strict=True):
        rows = sum(r.size for r in rest)
        found[block.drive] += float(np.sum(fit.aim[first : first + rows] ** 2))
        first += rows
    return found


def _drives(fit: Fit) -> list[tuple[str, ...]]:
    """Drives that each coordinate and each dial can change."""
    system, chain = fit.model.system, fit.model.chain
    found = [system.touched(chain, c) for c in fit.model.known]
    found += [system.slow_drives(chain)] * sum(q.size for q in fit.point.q)
    for candidate, effect in zip(fit.candidates, fit.point.effects, strict=False):
        found += [fit.model.concerned(effect)] * len(candidate.dials)
    return found


def limits_of(fit: Fit, z: Floats, step: float = REACH) -> tuple[Floats, Floats]:
    """Between what a step may move the coordinates to: the system's are held, the slow are free."""
    own = np.arange(z.size) < len(fit.point.x)
    far = fit.model.system.farthest
    low = np.maximum(z - step, np.minimum(-far, z))
    high = np.minimum(z + step, np.maximum(far, z))
    return np.where(own, low, -np.inf), np.where(own, high, np.inf)


def _steps(fit: Fit, full: Floats, slope: Floats, normal: Floats) -> Iterator[Floats]:
    """Yield shares of a full step; then Marquardt's, which hold back where little is known."""
    yield from (share * full for share in SHARES)
    z = coordinates_of(fit.point)
    low, high = limits_of(fit, z)
    for damping in DAMPINGS:
        held = normal + damping * np.diag(np.diag(normal))
        step = np.asarray(np.linalg.solve(held, slope), np.float64)
        step[: z.size] = np.clip(step[: z.size], low - z, high - z)
        yield step


def _slope(fit: Fit, z: Floats, u: Floats) -> Floats:
    """Half the negative gradient of the objective: coordinates first, then dials."""
    to_z = fit.nuisances.columns.T @ fit.aim - z
    if not u.size:
        return np.asarray(to_z)
    to_u = fit.columns.T @ fit.aim - u / deviations(fit.candidates) ** 2
    return np.concatenate((to_z, to_u))


def there(fit: Fit, dz: Floats, du: Floats) -> Fit | None:
    """Return the fit after a step of coordinates and dials; None where it cannot be simulated."""
    candidates = turned(fit.candidates, du)
    effects = tuple(c.effect() for c in candidates) if candidates else fit.point.effects
    point = replace(moved(fit.model, fit.point, dz), effects=effects)
    try:
        predicted = predict(fit.model, point)
    except PlantError:
        return None
    measured = "columns" in fit.__dict__ and fit.model.system.smooth
    strengths = strengths_of(fit.columns) if measured else fit.strengths
    new = replace(fit, point=point, predicted=predicted, candidates=candidates, strengths=strengths)
    new.__dict__["nuisances"] = fit.nuisances
    return new


def turned(now: Sequence[Dialled], step: Floats) -> tuple[Dialled, ...]:
    """Return the candidates with all their dials moved."""
    if not now:
        return ()
    places = np.cumsum([len(c.dials) for c in now])[:-1]
    return tuple(c.moved(s) for c, s in zip(now, np.split(step, places), strict=True))
