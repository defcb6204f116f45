"""Locate without the library: at every place, along every quantity, a free curve f(z).

f is a broken line over seven knots. Its gain on the training recordings, and what the same curve
gains on the held-out ones, say where something is missing and along what. How certain that is, is
told by what the curve foretells: in every stretch of the training recordings the curve that the
other stretches give, and on the held-out recordings the curve itself.
"""

from dataclasses import dataclass

import numpy as np

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.tooth_curve import tooth_columns
from slipbench.identification.mismatch.curves.trace import (
    answers_to,
    replies,
    seen_by,
    simulated_along,
)
from slipbench.identification.mismatch.curves.tries import (
    Try,
    along_angles,
    along_quantities,
    at_teeth,
)
from slipbench.identification.mismatch.fit.judge import Judge
from slipbench.identification.mismatch.fit.scatter import SHARE, amplitude_p
from slipbench.identification.mismatch.fit.stack import flat
from slipbench.identification.mismatch.simulation.along import ANGLE
from slipbench.plant.signals import Floats

CONFIRMED = 5.0  # nats, on the held-out recordings


@dataclass(frozen=True)
class _Held:
    """What a curve does on held-out recordings: nats, nats if it were right, whitened course."""

    gain: float
    worth: float
    course: Floats


def locate(training: Judge, held_out: Judge | None) -> list[Curve]:
    """Fit every curve; the best first, by what both sets of recordings say together."""
    found = [*along_quantities(training), *along_angles(training), *at_teeth(training)]
    nothing = _Held(0.0, 0.0, np.zeros(0))
    held = [nothing] * len(found) if held_out is None else _confirmed(held_out, found)
    curves = [
        Curve(
            f.place.name,
            f.place.block,
            f.place.unit,
            f.regressor,
            f.knots,
            f.place.size * f.values,
            f.gain,
            h.gain,
            h.worth,
            _family_p(f, h, training, held_out, len(found)),
        )
        for f, h in zip(found, held, strict=True)
    ]
    return sorted(curves, key=lambda c: (not c.certain, _doubt(c)))


def _family_p(
    found: "Try", held: "_Held", training: Judge, held_out: Judge | None, curves: int
) -> float:
    """p of what a curve foretells; 1 where it brings too little or held-out runs contradict it.

    Held-out recordings weigh as much as they would show of it.
    """
    if found.foretold is None or (held.worth >= CONFIRMED > held.gain):
        return 1.0
    course, left, groups = found.foretold, training.left, training.groups
    if held_out is not None and held.course.size:
        course = np.concatenate((course, held.course))
        left = np.concatenate((left, held_out.left))
        groups = np.concatenate((groups, held_out.groups + 1 + groups.max()))
    least = found.place.counts * found.place.size / found.swing
    p = amplitude_p(course, left, groups, training.fit.scatter, least)
    return min(1.0, p * curves / (1.0 - SHARE))


def _doubt(curve: Curve) -> float:
    """Order of curves: by their gain, held down by what the held-out recordings contradict."""
    if curve.tested < CONFIRMED:
        return -0.5 * curve.gain
    return -min(curve.gain, 3.0 * curve.confirmed + 1e-3 * curve.gain)


def _confirmed(judge: Judge, found: list[Try]) -> list[_Held]:
    """What the very same curves do on other recordings."""
    seen = {drive: seen_by(judge.fit, drive) for drive in judge.fit.model.chain.drives}
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
        answered = answers_to(replies(judge.fit, tries[0].place), pushes)
        off = judge.nuisances.off(flat(judge.fit.model, judge.fit.noise, answered))
        for f, trace in zip(known, off.T, strict=True):
            held[place, f.regressor] = _held(judge, trace)
        for f in tries:
            if f.regressor == ANGLE and ANGLE in here[0][1]:
                pushed = [f.place.size * f.values]
                turned = simulated_along(judge.fit, f.place, ANGLE, f.knots, pushed)
                turned_off = judge.nuisances.off(flat(judge.fit.model, judge.fit.noise, turned))
                held[place, ANGLE] = _held(judge, turned_off[:, 0])
    nothing = _Held(0.0, 0.0, np.zeros(0))
    return [held.get((f.place.name, f.regressor), nothing) for f in found]


def _held(judge: Judge, course: Floats) -> _Held:
    worth = 0.5 * float(course @ course)
    return _Held(float(course @ judge.left) - worth, worth, np.ascontiguousarray(course))
