"""Locate without the library: at every place, along every quantity, a free curve f(z).

f is a broken line over seven knots. Its gain on the training recordings, and what the same curve
gains on the held-out ones, say where something is missing and along what. How certain that is, is
told by what the curve foretells: in every stretch of the training recordings the curve that the
other stretches give, and on the held-out recordings the curve itself.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from identification.mismatch.along import columns, has_memory, knots_for
from identification.mismatch.fitting import Fit
from identification.mismatch.injection import answers, places, respond
from identification.mismatch.model import Series
from identification.mismatch.place import Injection
from identification.mismatch.scatter import FAMILY, SHARE, amplitude_p
from identification.mismatch.score import Judge
from identification.mismatch.stack import Integers, flat
from identification.mismatch.tooth_curve import ANGLE, discs, tooth_columns
from plant.signals import Floats

MINIMUM = 15.0  # nats, on the training recordings, beyond half the number of knots
CONFIRMED = 5.0  # nats, on the held-out ones
FOLDS = 4


@dataclass(frozen=True)
class Curve:
    """f(z) at a place. knots: of z, SI; values: of f, SI; gain, confirmed: nats.

    tested: nats that the curve would be worth on the held-out recordings if it were right. p: that
    what it foretells came by chance, family-wise over all curves and the library.
    """

    place: str
    block: str
    unit: str
    regressor: str
    knots: Floats
    values: Floats
    gain: float
    confirmed: float
    tested: float
    p: float

    @property
    def remembers(self) -> bool:
        """Whether it acts along the past of a quantity; knots are then times of forgetting, s."""
        return has_memory(self.regressor)

    @property
    def certain(self) -> bool:
        """Whether it is more than chance, and the held-out recordings do not contradict it."""
        return self.p < FAMILY

    def __call__(self, z: Floats, width: float = 0.0) -> Floats:
        """Evaluate f along a course; beyond the last knots it goes on level. width: s, of a bin."""
        return np.asarray(columns(self.regressor, z, self.knots, width) @ self.values)


def locate(training: Judge, held_out: Judge | None) -> list[Curve]:
    """Fit every curve; the best first, by what both sets of recordings say together."""
    found = [*_fits(training), *_tooth_fits(training)]
    nothing = _Held(0.0, 0.0, np.zeros(0))
    held = [nothing] * len(found) if held_out is None else _confirmed(held_out, found)
    curves = [
        Curve(f.place.name, f.place.block, f.place.unit, f.regressor, f.knots,
              f.place.size * f.values, f.gain, h.gain, h.worth,
              _family_p(f, h, training, held_out, len(found)))
        for f, h in zip(found, held, strict=True)
    ]  # fmt: skip
    return sorted(curves, key=lambda c: (not c.certain, _doubt(c)))


def _family_p(
    found: "_Try", held: "_Held", training: Judge, held_out: Judge | None, curves: int
) -> float:
    """p of what a curve foretells; 1 where it brings too little or held-out runs contradict it."""
    testable = held.worth >= CONFIRMED
    if found.foretold is None or (testable and held.gain < CONFIRMED):
        return 1.0
    course, left, groups = found.foretold, training.left, training.groups
    if held_out is not None and testable:
        course = np.concatenate((course, held.course))
        left = np.concatenate((left, held_out.left))
        groups = np.concatenate((groups, held_out.groups + 1 + groups.max()))
    least = found.place.counts * found.place.size / found.swing
    p = amplitude_p(course, left, groups, training.fit.scatter, least)
    return min(1.0, p * curves / (1.0 - SHARE))


def _foretold(off: Floats, left: Floats, groups: Integers) -> Floats:
    """Course in every fold of the stretches that the other folds give, (rows,)."""
    course = np.zeros(len(left))
    for fold in range(FOLDS):
        here = groups % FOLDS == fold
        there = off[~here]
        normal = there.T @ there + 0.01 * np.eye(off.shape[1])
        course[here] = off[here] @ np.linalg.solve(normal, there.T @ left[~here])
    return course


def effect_of(judge: Judge, curve: Curve) -> Series:
    """Return what a curve leaves in the outputs, unwhitened, (T, m) by block and record."""
    place = next(p for p in (*places(judge.fit), *_sensors(judge.fit)) if p.name == curve.place)
    courses = _courses(judge.fit)[place.drive]
    widths = _widths(judge.fit)
    pushes = [curve(c[curve.regressor], w)[:, None] for c, w in zip(courses, widths, strict=True)]
    answered = _answered(_replies(judge.fit, place), pushes)
    return [[one[:, :, 0] if one.size else one for one in block] for block in answered]


def locate_along(judge: Judge, place: Injection, regressor: str, knots: Floats) -> Floats:
    """Return f at given knots, SI, that what is left asks for at one place."""
    courses = _courses(judge.fit)[place.drive]
    hats = [
        columns(regressor, c[regressor], knots, w) * place.size
        for c, w in zip(courses, _widths(judge.fit), strict=True)
    ]
    answered = _answered(_replies(judge.fit, place), hats)
    off = judge.nuisances.off(flat(judge.fit.model, judge.fit.noise, answered))
    normal = off.T @ off + 0.01 * np.eye(knots.size)
    aim = off.T @ judge.left
    return np.asarray(place.size * np.linalg.solve(normal, aim))


def _doubt(curve: Curve) -> float:
    """Order of curves: by their gain, held down by what the held-out recordings contradict."""
    if curve.tested < CONFIRMED:
        return -0.5 * curve.gain
    return -min(curve.gain, 3.0 * curve.confirmed + 1e-3 * curve.gain)


@dataclass(frozen=True)
class _Try:
    """One curve at one place. values: f at the knots in shares of the place's size.

    foretold: whitened course, (rows,), of what other stretches foretell; None: too little gain.
    """

    place: Injection
    regressor: str
    knots: Floats
    values: Floats
    gain: float
    foretold: Floats | None = None

    @property
    def swing(self) -> float:
        """How far f goes up and down, half of it, in the place's unit."""
        return max(0.5 * float(np.ptp(self.values)) * self.place.size, 1e-300)


@dataclass(frozen=True)
class _Held:
    """What a curve does on held-out recordings: nats, nats if it were right, whitened course."""

    gain: float
    worth: float
    course: Floats


def _courses(fit: Fit) -> dict[str, list[dict[str, Floats]]]:
    """Regressors by drive and record, those that all records have."""
    records = range(len(fit.model.records))
    found = {}
    for drive in fit.model.chain.drives:
        courses = [regressors(fit, drive, r) for r in records]
        shared = sorted(set.intersection(*(set(c) for c in courses)))
        found[drive] = [{name: c[name] for name in shared} for c in courses]
    return found


def _widths(fit: Fit) -> list[float]:
    return [record.grid.width for record in fit.model.records]


def regressors(fit: Fit, drive: str, r: int) -> Mapping[str, Floats]:
    """Courses of what the recording and the fitted simulation tell of one drive, (bins,) each."""
    model = fit.model
    return model.at(fit.point).regressors(model.records[r], model.chain, drive, fit.point.q[r])


def _fits(judge: Judge) -> Iterator[_Try]:
    """Fit every curve to what the training recordings leave."""
    courses = _courses(judge.fit)
    knots = {
        drive: {n: knots_for(n, np.concatenate([c[n] for c in cs])) for n in cs[0]}
        for drive, cs in courses.items()
    }
    widths = _widths(judge.fit)
    for place in (*places(judge.fit), *_sensors(judge.fit)):
        useful = {n: k for n, k in knots[place.drive].items() if k.size > 2}
        hats = [
            place.size * np.concatenate([columns(n, c[n], k, w) for n, k in useful.items()], axis=1)
            for c, w in zip(courses[place.drive], widths, strict=True)
        ]
        answered = _answered(_replies(judge.fit, place), hats)
        off = judge.nuisances.off(flat(judge.fit.model, judge.fit.noise, answered))
        aims = off.T @ judge.left
        first = 0
        for regressor, k in useful.items():
            part = slice(first, first + k.size)
            first += k.size
            normal = off[:, part].T @ off[:, part] + 0.01 * np.eye(k.size)
            values = np.asarray(np.linalg.solve(normal, aims[part]))
            gain = 0.5 * float(aims[part] @ values)
            yield _Try(place, regressor, k, values, gain, _course(judge, off[:, part], gain))


def _course(judge: Judge, off: Floats, gain: float) -> Floats | None:
    enough = MINIMUM + 0.5 * off.shape[1]
    return _foretold(off, judge.left, judge.groups) if gain > enough else None


def _tooth_fits(judge: Judge) -> Iterator[_Try]:
    """Fit one value for every tooth of every toothed wheel."""
    for place, angles in discs(judge.fit):
        off = judge.nuisances.off(
            flat(judge.fit.model, judge.fit.noise, tooth_columns(judge.fit, place))
        )
        normal = off.T @ off + 0.01 * np.eye(angles.size)
        aim = off.T @ judge.left
        values = np.asarray(np.linalg.solve(normal, aim))
        gain = 0.5 * float(aim @ values)
        yield _Try(place, ANGLE, angles, values, gain, _course(judge, off, gain))


def _confirmed(judge: Judge, found: list[_Try]) -> list[_Held]:
    """What the very same curves do on other recordings."""
    courses = _courses(judge.fit)
    held: dict[tuple[str, str], _Held] = {}
    for place in dict.fromkeys(f.place.name for f in found):
        tries = [f for f in found if f.place.name == place]
        if tries[0].regressor == ANGLE:
            teeth = flat(judge.fit.model, judge.fit.noise, tooth_columns(judge.fit, tries[0].place))
            held[place, ANGLE] = _held(judge, judge.nuisances.off(teeth @ tries[0].values))
            continue
        known = [f for f in tries if f.regressor in courses[f.place.drive][0]]
        pushes = [
            np.column_stack(
                [
                    f.place.size * columns(f.regressor, c[f.regressor], f.knots, w) @ f.values
                    for f in known
                ]
            )
            for c, w in zip(courses[tries[0].place.drive], _widths(judge.fit), strict=True)
        ]
        answered = _answered(_replies(judge.fit, tries[0].place), pushes)
        off = judge.nuisances.off(flat(judge.fit.model, judge.fit.noise, answered))
        for f, course in zip(known, off.T, strict=True):
            held[place, f.regressor] = _held(judge, course)
    nothing = _Held(0.0, 0.0, np.zeros(0))
    return [held.get((f.place.name, f.regressor), nothing) for f in found]


def _held(judge: Judge, course: Floats) -> _Held:
    worth = 0.5 * float(course @ course)
    return _Held(float(course @ judge.left) - worth, worth, np.ascontiguousarray(course))


def _sensors(fit: Fit) -> list[Injection]:
    """Every sensor that may be wrong as a place of its own."""
    return [
        Injection(f"sensor of {o.replace('_', ' ')}", f"{o} sensor", s.unit,
                  float(np.std(s.value)) + 1e-3, b.drive, counts=0.002)
        for b in fit.model.chain.blocks if b.sensors_suspected
        for o in b.outputs for s in (fit.model.records[0].sensors[o],)
    ]  # fmt: skip


def _replies(fit: Fit, place: Injection) -> Series:
    """Answers to a push in a bin; a sensor answers by itself, at once."""
    if place.push:
        return answers(fit, place)
    found: Series = [[np.empty(0)] * len(fit.model.records) for _ in fit.model.chain.blocks]
    for b, block in enumerate(fit.model.chain.blocks):
        for j, output in enumerate(block.outputs):
            if place.block == f"{output} sensor":
                now = np.zeros((1, len(block.outputs)))
                now[0, j] = 1.0
                found[b] = [now] * len(fit.model.records)
    return found


def _answered(reply: Series, hats: list[Floats]) -> Series:
    return [[respond(a, h) if a.size else a for a, h in zip(b, hats, strict=True)] for b in reply]
