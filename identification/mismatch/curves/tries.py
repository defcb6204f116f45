"""Every curve fitted at every place to what the training recordings leave."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.curves.injection import places
from slipbench.identification.mismatch.curves.tooth_curve import discs, tooth_columns
from slipbench.identification.mismatch.curves.trace import (
    answers_to,
    in_bins,
    over_all,
    replies,
    seen_by,
    sensors_as_places,
    simulated_along,
)
from slipbench.identification.mismatch.fit.judge import Judge
from slipbench.identification.mismatch.fit.stack import Integers, flat
from slipbench.identification.mismatch.simulation.along import ANGLE, course, knots_for
from slipbench.identification.mismatch.simulation.model import Series
from slipbench.identification.mismatch.simulation.place import Injection
from slipbench.plant.signals import Floats

MINIMUM = 15.0  # nats, on the training recordings, beyond half the number of knots
FOLDS = 4


@dataclass(frozen=True)
class Try:
    """One curve at one place. values: f at the knots in shares of the place's size.

    swing: how far its course goes up and down, half of it, in the place's unit. foretold: whitened
    course, (rows,), of what other stretches foretell; None: too little gain.
    """

    place: Injection
    regressor: str
    knots: Floats
    values: Floats
    gain: float
    swing: float
    foretold: Floats | None = None

    def along(self, seen: Mapping[str, Floats], step: float) -> Floats:
        """Return what it pushes, row by row."""
        values = self.place.size * self.values
        return course(self.regressor, seen[self.regressor], self.knots, values, step)


def along_quantities(judge: Judge) -> Iterator[Try]:
    """Fit every curve to what the training recordings leave."""
    drives = judge.fit.model.chain.drives
    useful, binned = {}, {}
    for drive in drives:
        seen = seen_by(judge.fit, drive)
        knots = {n: knots_for(n, over_all(n, seen)) for n in seen[0][1] if n != ANGLE}
        useful[drive] = {n: k for n, k in knots.items() if k.size > 2}
        binned[drive] = [in_bins(record, useful[drive], s) for record, s in seen]
    for place in (*places(judge.fit), *sensors_as_places(judge.fit)):
        hats = [place.size * b for b in binned[place.drive]]
        answered = answers_to(replies(judge.fit, place), hats)
        off = judge.nuisances.off(flat(judge.fit.model, judge.fit.noise, answered))
        aims = off.T @ judge.left
        first = 0
        for regressor, k in useful[place.drive].items():
            part = slice(first, first + k.size)
            first += k.size
            normal = off[:, part].T @ off[:, part] + 0.01 * np.eye(k.size)
            values = np.asarray(np.linalg.solve(normal, aims[part]))
            gain = 0.5 * float(aims[part] @ values)
            swing = _swing(np.concatenate([h[:, part] for h in hats]) @ values)
            foretold = _course(judge, off[:, part], gain)
            yield Try(place, regressor, k, values, gain, swing, foretold)


def along_angles(judge: Judge) -> Iterator[Try]:
    """Fit what is pushed along the angle of a wheel, at every place.

    A turn takes but some bins, too few for answers to pushes in whole bins: each knot is simulated.
    """
    for place in places(judge.fit):
        seen = seen_by(judge.fit, place.drive)
        if ANGLE not in seen[0][1]:
            continue
        knots = knots_for(ANGLE, over_all(ANGLE, seen))
        if knots.size > 2:
            pushes = place.size * np.eye(knots.size)
            series = simulated_along(judge.fit, place, ANGLE, knots, pushes)
            yield _one(judge, place, knots, series)


def at_teeth(judge: Judge) -> Iterator[Try]:
    """Fit one value for every tooth of every toothed wheel."""
    for place, angles in discs(judge.fit):
        yield _one(judge, place, angles, tooth_columns(judge.fit, place))


def _one(judge: Judge, place: Injection, angles: Floats, series: Series) -> Try:
    """Fit values along the angle of a wheel, from what a push worth trying at each brings."""
    columns = flat(judge.fit.model, judge.fit.noise, series)
    off = judge.nuisances.off(columns)
    normal = off.T @ off + 0.01 * np.eye(angles.size)
    aim = off.T @ judge.left
    values = np.asarray(np.linalg.solve(normal, aim))
    gain = 0.5 * float(aim @ values)
    swing = _swing(place.size * values * _kept(columns @ values, off @ values))
    return Try(place, ANGLE, angles, values, gain, swing, _course(judge, off, gain))


def _kept(course: Floats, off: Floats) -> float:
    """Share of a course, of its amplitude, that the nuisances leave.

    Along what is named already a curve may go anywhere at no cost; that says nothing of its size.
    """
    whole = float(course @ course)
    return min(1.0, float(np.sqrt(off @ off / whole))) if whole > 0.0 else 1.0


def _swing(pushes: Floats) -> float:
    return max(0.5 * float(np.ptp(pushes)), 1e-300)


def _course(judge: Judge, off: Floats, gain: float) -> Floats | None:
    enough = MINIMUM + 0.5 * off.shape[1]
    return _foretold(off, judge.left, judge.groups) if gain > enough else None


def _foretold(off: Floats, left: Floats, groups: Integers) -> Floats:
    """Course in every fold of the stretches that the other folds give, (rows,)."""
    course = np.zeros(len(left))
    for fold in range(FOLDS):
        here = groups % FOLDS == fold
        there = off[~here]
        normal = there.T @ there + 0.01 * np.eye(off.shape[1])
        course[here] = off[here] @ np.linalg.solve(normal, there.T @ left[~here])
    return course
