"""Locate without the library: at every place, along every quantity, a free curve f(z).

f is a broken line over seven knots. Its gain on the training recordings, and what the same curve
gains on the held-out ones, say where something is missing and along what.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from identification.mismatch.fitting import Fit
from identification.mismatch.injection import answers, places, respond
from identification.mismatch.model import Series
from identification.mismatch.place import Injection
from identification.mismatch.score import Judge
from identification.mismatch.stack import flat
from identification.mismatch.tooth_curve import ANGLE, discs, tooth_columns
from plant.signals import Floats

KNOTS = 7
MINIMUM = 15.0  # nats, on the training recordings, beyond half the number of knots
CONFIRMED = 5.0  # nats, on the held-out ones


@dataclass(frozen=True)
class Curve:
    """f(z) at a place. knots: of z, SI; values: of f, SI; gain, confirmed: nats.

    tested: nats that the curve would be worth on the held-out recordings if it were right.
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

    @property
    def certain(self) -> bool:
        """Whether both sets of recordings speak for it, or one that the other cannot contradict."""
        enough = MINIMUM + 0.5 * self.knots.size
        if self.tested < CONFIRMED:
            return self.gain > 2.0 * enough
        return self.gain > enough and self.confirmed > CONFIRMED

    def __call__(self, z: Floats) -> Floats:
        """Evaluate f; beyond the last knots it goes on level."""
        return np.interp(z, self.knots, self.values)


def locate(training: Judge, held_out: Judge | None) -> list[Curve]:
    """Fit every curve; the best first, by what both sets of recordings say together."""
    found, teeth = list(_fits(training)), list(_tooth_fits(training))
    confirmed = [(0.0, 0.0)] * (len(found) + len(teeth))
    if held_out is not None:
        confirmed = _confirmed(held_out, found) + [_same_teeth(held_out, t) for t in teeth]
    found += teeth
    curves = [
        Curve(f.place.name, f.place.block, f.place.unit, f.regressor, f.knots,
              f.place.size * f.values, f.gain, *held)
        for f, held in zip(found, confirmed, strict=True)
    ]  # fmt: skip
    return sorted(curves, key=_doubt)


def effect_of(judge: Judge, curve: Curve) -> Series:
    """Return what a curve leaves in the outputs, unwhitened, (T, m) by block and record."""
    place = next(p for p in (*places(judge.fit), *_sensors(judge.fit)) if p.name == curve.place)
    courses = _courses(judge.fit)[place.drive]
    pushes = [curve(c[curve.regressor])[:, None] for c in courses]
    answered = _answered(_replies(judge.fit, place), pushes)
    return [[one[:, :, 0] if one.size else one for one in block] for block in answered]


def locate_along(judge: Judge, place: Injection, regressor: str, knots: Floats) -> Floats:
    """Return f at given knots, SI, that what is left asks for at one place."""
    courses = _courses(judge.fit)[place.drive]
    hats = [_hats(c[regressor], knots) * place.size for c in courses]
    columns = flat(judge.fit.model, judge.fit.noise, _answered(_replies(judge.fit, place), hats))
    normal = columns.T @ judge.nuisances.off(columns) + 0.01 * np.eye(knots.size)
    aim = judge.nuisances.off(columns).T @ judge.fit.aim
    return np.asarray(place.size * np.linalg.solve(normal, aim))


def _doubt(curve: Curve) -> float:
    """Order of curves: by their gain, held down by what the held-out recordings contradict."""
    if curve.tested < CONFIRMED:
        return -0.5 * curve.gain
    return -min(curve.gain, 3.0 * curve.confirmed + 1e-3 * curve.gain)


@dataclass(frozen=True)
class _Try:
    """One curve at one place. values: f at the knots in shares of the place's size."""

    place: Injection
    regressor: str
    knots: Floats
    values: Floats
    gain: float


def _courses(fit: Fit) -> dict[str, list[dict[str, Floats]]]:
    """Regressors by drive and record, those that all records have."""
    records = range(len(fit.model.records))
    found = {}
    for drive in fit.model.chain.drives:
        courses = [regressors(fit, drive, r) for r in records]
        shared = sorted(set.intersection(*(set(c) for c in courses)))
        found[drive] = [{name: c[name] for name in shared} for c in courses]
    return found


def regressors(fit: Fit, drive: str, r: int) -> Mapping[str, Floats]:
    """Courses of what the recording and the fitted simulation tell of one drive, (bins,) each."""
    model = fit.model
    return model.at(fit.point).regressors(model.records[r], model.chain, drive, fit.point.q[r])


def _fits(judge: Judge) -> Iterator[_Try]:
    """Fit every curve to what the training recordings leave."""
    courses = _courses(judge.fit)
    knots = {
        drive: {n: knots_between(np.concatenate([c[n] for c in cs])) for n in cs[0]}
        for drive, cs in courses.items()
    }
    for place in (*places(judge.fit), *_sensors(judge.fit)):
        useful = {n: k for n, k in knots[place.drive].items() if k.size > 2}
        hats = [
            np.concatenate([_hats(c[n], k) for n, k in useful.items()], axis=1) * place.size
            for c in courses[place.drive]
        ]
        columns = flat(
            judge.fit.model, judge.fit.noise, _answered(_replies(judge.fit, place), hats)
        )
        off = judge.nuisances.off(columns)
        aims = off.T @ judge.fit.aim
        first = 0
        for regressor, k in useful.items():
            part = slice(first, first + k.size)
            first += k.size
            normal = columns[:, part].T @ off[:, part] + 0.01 * np.eye(k.size)
            values = np.asarray(np.linalg.solve(normal, aims[part]))
            yield _Try(place, regressor, k, values, 0.5 * float(aims[part] @ values))


def _tooth_fits(judge: Judge) -> Iterator[_Try]:
    """Fit one value for every tooth of every toothed wheel."""
    for place, angles in discs(judge.fit):
        columns = flat(judge.fit.model, judge.fit.noise, tooth_columns(judge.fit, place))
        normal = columns.T @ columns + 0.01 * np.eye(angles.size)
        aim = columns.T @ judge.fit.aim
        values = np.asarray(np.linalg.solve(normal, aim))
        yield _Try(place, ANGLE, angles, values, 0.5 * float(aim @ values))


def _same_teeth(judge: Judge, found: _Try) -> tuple[float, float]:
    columns = flat(judge.fit.model, judge.fit.noise, tooth_columns(judge.fit, found.place))
    course = columns @ found.values
    worth = 0.5 * float(course @ course)
    return float(course @ judge.fit.aim) - worth, worth


def _confirmed(judge: Judge, found: list[_Try]) -> list[tuple[float, float]]:
    """What the very same curves gain on other recordings, and would if they were right; nats."""
    courses = _courses(judge.fit)
    gained: dict[tuple[str, str], tuple[float, float]] = {}
    for place in dict.fromkeys(f.place.name for f in found):
        tries = [f for f in found if f.place.name == place]
        known = [f for f in tries if f.regressor in courses[f.place.drive][0]]
        pushes = [
            np.column_stack(
                [f.place.size * np.interp(c[f.regressor], f.knots, f.values) for f in known]
            )
            for c in courses[tries[0].place.drive]
        ]
        replies = _replies(judge.fit, tries[0].place)
        columns = flat(judge.fit.model, judge.fit.noise, _answered(replies, pushes))
        off = judge.nuisances.off(columns)
        worth = 0.5 * np.sum(off * columns, axis=0)
        gains = off.T @ judge.fit.aim - worth
        for f, g, w in zip(known, gains, worth, strict=True):
            gained[place, f.regressor] = float(g), float(w)
    return [gained.get((f.place.name, f.regressor), (0.0, 0.0)) for f in found]


def _sensors(fit: Fit) -> list[Injection]:
    """Every sensor that may be wrong as a place of its own."""
    return [
        Injection(f"sensor of {o.replace('_', ' ')}", f"{o} sensor", s.unit,
                  float(np.std(s.value)) + 1e-3, b.drive)
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


def knots_between(z: Floats) -> Floats:
    """Knots at quantiles, no two nearer than a thirtieth of the range."""
    low, high = np.quantile(z, (0.002, 0.998))
    if not high > low:
        return np.empty(0)
    wanted = 0.5 * np.quantile(z, np.linspace(0.002, 0.998, KNOTS)) + 0.5 * np.linspace(
        low, high, KNOTS
    )
    return wanted[np.concatenate(([True], np.diff(wanted) > (high - low) / 30))]


def _hats(z: Floats, knots: Floats) -> Floats:
    return np.column_stack([np.interp(z, knots, row) for row in np.eye(knots.size)])
