"""Every curve fitted at every place to what the training recordings leave."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.curves.injection import places
from slipbench.identification.mismatch.curves.tooth_curve import discs, tooth_columns
from slipbench.identification.mismatch.curves.trace import (
    over_all,
    sensors_as_places,
    simulated_responses,
)
from slipbench.identification.mismatch.curves.whitened import Whitened
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.stack import LARGEST, Integers, whiten_and_stack
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.identification.mismatch.simulation.regressor import ANGLE, TURN, kind_of, knots_for
from slipbench.plant.signals import Floats

MINIMUM = 15.0  # nats, on the training recordings, beyond half the number of knots
FOLDS = 4
RIDGE = 0.01
"""Of a curve's values, in pushes worth trying: what holds a value that recordings hardly see."""


@dataclass(frozen=True)
class CurveCandidate:
    """One curve at one place. values: f at the knots in shares of the place's size.

    half_range: how far its course goes up and down, half of it, in the place's unit. foretold: whitened
    course, (rows,), of what other stretches foretell; None: too little gain.
    """

    place: InjectionPoint
    regressor: str
    knots: Floats
    values: Floats
    log_likelihood_gain: float
    half_range: float
    cross_predicted: Floats | None = None


def scan_curves(linear: Linearization, whitened: Whitened) -> Iterator[list[CurveCandidate]]:
    """Fit every curve to what the training recordings leave; yield those of a place together.

    Where columns would be too many to hold at once, a place comes several times.
    """
    fit = linear.fit
    everywhere = (*places(fit), *sensors_as_places(fit))
    for subsystem in fit.model.partition.subsystems:
        seen = whitened.seen_by(subsystem)
        knots = {n: knots_for(n, over_all(n, seen)) for n in seen[0][1] if kind_of(n) != TURN}
        useful = {n: k for n, k in knots.items() if k.size > 2}
        for some in _held_at_once(useful, len(linear.clusters)):
            for place in everywhere:
                if place.subsystem == subsystem:
                    yield _at_place(linear, place, some, whitened)


def _held_at_once(knots: Mapping[str, Floats], rows: int) -> Iterator[dict[str, Floats]]:
    """Yield the quantities in parts whose columns are not too large together."""
    part: dict[str, Floats] = {}
    for name, k in knots.items():
        if part and rows * (sum(map(np.size, part.values())) + k.size) > LARGEST:
            yield part
            part = {}
        part[name] = k
    if part:
        yield part


def _at_place(
    linear: Linearization, place: InjectionPoint, knots: Mapping[str, Floats], whitened: Whitened
) -> list[CurveCandidate]:
    """Fit the curves along these quantities at one place.

    Their columns are taken off the nuisances only where a curve gains enough to be foretold: for
    its values, products with the nuisances suffice (see `Nuisances.inside`).
    """
    tents = whitened.along(place.subsystem, knots)
    columns = place.size * whitened.columns(place, tents)
    aims = columns.T @ linear.residuals[: len(columns)]
    inside, hidden = linear.nuisances.products(columns)
    found, first = [], 0
    for regressor, k in knots.items():
        part = slice(first, first + k.size)
        first += k.size
        own = columns[:, part]
        normal = own.T @ own - inside[:, part].T @ hidden[:, part] + RIDGE * np.eye(k.size)
        values = np.asarray(np.linalg.solve(normal, aims[part]))
        gain = 0.5 * float(aims[part] @ values)
        pushed = np.concatenate([h[:, part] for h in tents.pushes])
        swing = _swing(place.size * pushed @ values)
        predicted_held_out = None
        if gain > enough(k.size):
            off = linear.nuisances.subtract(own, hidden[:, part])
            predicted_held_out = _cross_predicted(off, linear.residuals, linear.clusters)
        found.append(CurveCandidate(place, regressor, k, values, gain, swing, predicted_held_out))
    return found


def around_turns(linear: Linearization, whitened: Whitened) -> Iterator[list[CurveCandidate]]:
    """Fit what comes back at every turn of an angle, at every place.

    A turn takes but some bins, too few for answers to pushes in whole bins: each knot is simulated. A
    sensor answers at once, whatever the bin.
    """
    for place in (*places(linear.fit), *sensors_as_places(linear.fit)):
        seen = whitened.seen_by(place.subsystem)
        for turn in (n for n in seen[0][1] if kind_of(n) == TURN):
            knots = knots_for(turn, over_all(turn, seen))
            if knots.size > 2 and place.inputs:
                pushes = place.size * np.eye(knots.size)
                series = simulated_responses(linear.fit, place, turn, knots, pushes, seen)
                yield [_one(linear, place, turn, knots, series)]
            elif knots.size > 2 and turn != ANGLE:  # a wheel's sensor is judged at its teeth
                yield _at_place(linear, place, {turn: knots}, whitened)


def at_teeth(linear: Linearization) -> Iterator[list[CurveCandidate]]:
    """Fit one value for every tooth of every toothed wheel."""
    for place, angles in discs(linear.fit):
        yield [_one(linear, place, ANGLE, angles, tooth_columns(linear.fit, place))]


def _one(
    linear: Linearization, place: InjectionPoint, turn: str, angles: Floats, series: Series
) -> CurveCandidate:
    """Fit values around a turn, from what a push worth trying at each angle brings."""
    columns = whiten_and_stack(linear.fit.model, linear.fit.noise, series)
    off = linear.nuisances.project_out(columns)
    normal = off.T @ off + RIDGE * np.eye(angles.size)
    aim = off.T @ linear.residuals
    values = np.asarray(np.linalg.solve(normal, aim))
    gain = 0.5 * float(aim @ values)
    swing = _swing(place.size * values * _kept(columns @ values, off @ values))
    return CurveCandidate(place, turn, angles, values, gain, swing, _course(linear, off, gain))


def _kept(course: Floats, off: Floats) -> float:
    """Share of a course, of its amplitude, that the nuisances leave.

    Along what is named already a curve may go anywhere at no cost; that says nothing of its size.
    """
    whole = float(course @ course)
    return min(1.0, float(np.sqrt(off @ off / whole))) if whole > 0.0 else 1.0


def _swing(pushes: Floats) -> float:
    return max(0.5 * float(np.ptp(pushes)), 1e-300)


def _course(linear: Linearization, off: Floats, gain: float) -> Floats | None:
    if gain <= enough(off.shape[1]):
        return None
    return _cross_predicted(off, linear.residuals, linear.clusters)


def enough(knots: int) -> float:
    """Nats from which a curve is worth a closer look, and from which so many more knots are."""
    return MINIMUM + 0.5 * knots


def _cross_predicted(off: Floats, left: Floats, groups: Integers) -> Floats:
    """Course in every fold of the stretches that the other folds give, (rows,)."""
    course = np.zeros(len(left))
    parts = [np.flatnonzero(groups % FOLDS == fold) for fold in range(FOLDS)]
    own = [off[part] for part in parts]
    normals = [o.T @ o for o in own]
    aims = [o.T @ left[part] for o, part in zip(own, parts, strict=True)]
    for fold, part in enumerate(parts):
        others = [i for i in range(FOLDS) if i != fold]
        normal = sum((normals[i] for i in others), RIDGE * np.eye(off.shape[1]))
        course[part] = own[fold] @ np.linalg.solve(normal, sum(aims[i] for i in others))
    return course
