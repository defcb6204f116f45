"""Locate without the library: at every place, along every quantity, a free curve f(z).

f is a broken line over seven knots. Its gain on the training recordings, and what the same curve
gains on the held-out ones, say where something is missing and along what. How certain that is, is
told by what the curve foretells: in every stretch of the training recordings the curve that the
other stretches give, and on the held-out recordings the curve itself.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identification.mismatch.along import SCALE, columns, course, kind_of, knots_for
from identification.mismatch.fitting import Fit
from identification.mismatch.injection import answers, places, respond
from identification.mismatch.model import Series, acting, predict
from identification.mismatch.place import Injection
from identification.mismatch.push import Push
from identification.mismatch.record import Record
from identification.mismatch.scatter import FAMILY, SHARE, amplitude_p
from identification.mismatch.score import Judge
from identification.mismatch.sensitivity import change
from identification.mismatch.stack import Integers, flat
from identification.mismatch.tooth_curve import ANGLE, SIZE, discs, tooth_columns
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
    def kind(self) -> str:
        """What its regressor begins with (see `along.kind_of`)."""
        return kind_of(self.regressor)

    @property
    def certain(self) -> bool:
        """Whether it is more than chance, and the held-out recordings do not contradict it."""
        return self.p < FAMILY

    def __call__(self, z: Floats, step: float = 1.0) -> Floats:
        """Evaluate f along a course; beyond the last knots it goes on level. step: s, of a row."""
        return course(self.regressor, z, self.knots, self.values, step)


def locate(training: Judge, held_out: Judge | None) -> list[Curve]:
    """Fit every curve; the best first, by what both sets of recordings say together."""
    found = [*_fits(training), *_turning_fits(training), *_tooth_fits(training)]
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
    for disc, _ in discs(judge.fit):
        if disc.name == curve.place:
            return _combined(tooth_columns(judge.fit, disc), curve.values / SIZE)
    place = next(p for p in (*places(judge.fit), *_sensors(judge.fit)) if p.name == curve.place)
    if place.push and curve.regressor == ANGLE:
        turned = _simulated(judge.fit, place, ANGLE, curve.knots, [curve.values])
        return [[one[:, :, 0] if one.size else one for one in block] for block in turned]
    pushes = [
        record.grid.binned(curve(seen[curve.regressor], record.grid.step))[:, None]
        for record, seen in _seen(judge.fit, place.drive)
    ]
    answered = _answered(_replies(judge.fit, place), pushes)
    return [[one[:, :, 0] if one.size else one for one in block] for block in answered]


def _combined(columns: Series, values: Floats) -> Series:
    return [[one @ values if one.size else one for one in block] for block in columns]


def answers_along(fit: Fit, place: Injection, regressor: str, knots: Floats) -> Series:
    """Return what each knot of a curve would leave in the outputs, (T, m, knots) per unit push."""
    binned = [_binned(record, {regressor: knots}, seen) for record, seen in _seen(fit, place.drive)]
    return _answered(_replies(fit, place), binned)


def _doubt(curve: Curve) -> float:
    """Order of curves: by their gain, held down by what the held-out recordings contradict."""
    if curve.tested < CONFIRMED:
        return -0.5 * curve.gain
    return -min(curve.gain, 3.0 * curve.confirmed + 1e-3 * curve.gain)


@dataclass(frozen=True)
class _Try:
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


@dataclass(frozen=True)
class _Held:
    """What a curve does on held-out recordings: nats, nats if it were right, whitened course."""

    gain: float
    worth: float
    course: Floats


def _seen(fit: Fit, drive: str) -> list[tuple[Record, dict[str, Floats]]]:
    """Every record with the regressors of a drive that all records have."""
    courses = [regressors(fit, drive, r) for r in range(len(fit.model.records))]
    shared = sorted(set.intersection(*(set(c) for c in courses)))
    return [
        (record, {name: c[name] for name in shared})
        for record, c in zip(fit.model.records, courses, strict=True)
    ]


def _binned(record: Record, knots: Mapping[str, Floats], seen: Mapping[str, Floats]) -> Floats:
    """Bin by bin what each knot of each regressor pushes, (bins, all knots)."""
    found = np.empty((record.grid.bins, sum(k.size for k in knots.values())))
    i = 0
    for name, at in knots.items():
        for pushes in columns(name, seen[name], at, record.grid.step):
            found[:, i] = record.grid.binned(pushes)
            i += 1
    return found


def regressors(fit: Fit, drive: str, r: int) -> Mapping[str, Floats]:
    """Courses of what the recording and the fitted simulation tell of one drive, (rows,) each."""
    model = fit.model
    added = acting(model, fit.point, r)
    system, record, q = model.at(fit.point), model.records[r], fit.point.q[r]
    return system.regressors(record, model.chain, drive, q, added)


def _fits(judge: Judge) -> Iterator[_Try]:
    """Fit every curve to what the training recordings leave."""
    drives = judge.fit.model.chain.drives
    useful, binned = {}, {}
    for drive in drives:
        seen = _seen(judge.fit, drive)
        knots = {n: knots_for(n, _over_all(n, seen)) for n in seen[0][1] if n != ANGLE}
        useful[drive] = {n: k for n, k in knots.items() if k.size > 2}
        binned[drive] = [_binned(record, useful[drive], s) for record, s in seen]
    for place in (*places(judge.fit), *_sensors(judge.fit)):
        hats = [place.size * b for b in binned[place.drive]]
        answered = _answered(_replies(judge.fit, place), hats)
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
            yield _Try(place, regressor, k, values, gain, swing, foretold)


def _turning_fits(judge: Judge) -> Iterator[_Try]:
    """Fit what is pushed along the angle of a wheel, at every place.

    A turn takes but some bins, too few for answers to pushes in whole bins: each knot is simulated.
    """
    for place in places(judge.fit):
        seen = _seen(judge.fit, place.drive)
        if ANGLE not in seen[0][1]:
            continue
        knots = knots_for(ANGLE, _over_all(ANGLE, seen))
        if knots.size > 2:
            pushes = place.size * np.eye(knots.size)
            series = _simulated(judge.fit, place, ANGLE, knots, pushes)
            yield _one(judge, place, knots, series)


def _simulated(
    fit: Fit, place: Injection, regressor: str, knots: Floats, pushes: Iterable[Floats]
) -> Series:
    """Return what curves of these values leave in the outputs, simulated, (T, m, curves).

    Nothing counts as left in the pattern of teeth: there their tolerance looks like any push that
    goes round with the wheel.
    """
    model, seen = fit.model.coarse, _seen(fit, place.drive)
    system, before = model.at(fit.point), predict(model, fit.point)
    changes = []
    for values in pushes:
        courses = tuple(
            system.push(place, r, course(regressor, s[regressor], knots, values, r.grid.step))
            for r, s in seen
        )
        effects = (*fit.point.effects, Push(place.drive, courses))
        changes.append(change(model, fit.point, effects, before))
    nothing = [np.empty(0)] * len(model.records)
    return [
        [_side_by_side(parts) for parts in zip(*blocks, strict=True)] if block.order else nothing
        for block, blocks in zip(model.chain.blocks, zip(*changes, strict=True), strict=True)
    ]


def _side_by_side(parts: Sequence[Floats]) -> Floats:
    return np.stack(parts, axis=-1) if parts[0].size else parts[0]


def _one(judge: Judge, place: Injection, angles: Floats, series: Series) -> _Try:
    """Fit values along the angle of a wheel, from what a push worth trying at each brings."""
    off = judge.nuisances.off(flat(judge.fit.model, judge.fit.noise, series))
    normal = off.T @ off + 0.01 * np.eye(angles.size)
    aim = off.T @ judge.left
    values = np.asarray(np.linalg.solve(normal, aim))
    gain = 0.5 * float(aim @ values)
    swing = _swing(place.size * values)
    return _Try(place, ANGLE, angles, values, gain, swing, _course(judge, off, gain))


def _swing(pushes: Floats) -> float:
    return max(0.5 * float(np.ptp(pushes)), 1e-300)


def _over_all(name: str, seen: Sequence[tuple[Record, Mapping[str, Floats]]]) -> Floats:
    """A quantity in the bins of all records, end to end."""
    courses = ((record, s[name][0] if kind_of(name) == SCALE else s[name]) for record, s in seen)
    return np.concatenate([record.grid.binned(z) for record, z in courses])


def _course(judge: Judge, off: Floats, gain: float) -> Floats | None:
    enough = MINIMUM + 0.5 * off.shape[1]
    return _foretold(off, judge.left, judge.groups) if gain > enough else None


def _tooth_fits(judge: Judge) -> Iterator[_Try]:
    """Fit one value for every tooth of every toothed wheel."""
    for place, angles in discs(judge.fit):
        yield _one(judge, place, angles, tooth_columns(judge.fit, place))


def _confirmed(judge: Judge, found: list[_Try]) -> list[_Held]:
    """What the very same curves do on other recordings."""
    seen = {drive: _seen(judge.fit, drive) for drive in judge.fit.model.chain.drives}
    held: dict[tuple[str, str], _Held] = {}
    for place in dict.fromkeys(f.place.name for f in found):
        tries = [f for f in found if f.place.name == place]
        if tries[0].regressor == ANGLE:
            teeth = flat(judge.fit.model, judge.fit.noise, tooth_columns(judge.fit, tries[0].place))
            held[place, ANGLE] = _held(judge, judge.nuisances.off(teeth @ tries[0].values))
            continue
        here = seen[tries[0].place.drive]
        known = [f for f in tries if f.regressor in here[0][1] and f.regressor != ANGLE]
        pushes = [
            np.column_stack([record.grid.binned(f.along(s, record.grid.step)) for f in known])
            for record, s in here
        ]
        answered = _answered(_replies(judge.fit, tries[0].place), pushes)
        off = judge.nuisances.off(flat(judge.fit.model, judge.fit.noise, answered))
        for f, trace in zip(known, off.T, strict=True):
            held[place, f.regressor] = _held(judge, trace)
        for f in tries:
            if f.regressor == ANGLE and ANGLE in here[0][1]:
                pushed = [f.place.size * f.values]
                turned = _simulated(judge.fit, f.place, ANGLE, f.knots, pushed)
                turned_off = judge.nuisances.off(flat(judge.fit.model, judge.fit.noise, turned))
                held[place, ANGLE] = _held(judge, turned_off[:, 0])
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
