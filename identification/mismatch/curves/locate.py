"""Locate without the library: at every place, along every quantity, a free curve f(z).

f is a broken line over seven knots. Its gain on the training recordings, and what the same curve
gains on the held-out ones, say where something is missing and along what. How certain that is, is
told by what the curve foretells: in every stretch of the training recordings the curve that the
other stretches give, and on the held-out recordings the curve itself.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain

import numpy as np
from scipy import linalg

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.scan import (
    CurveCandidate,
    around_turns,
    at_teeth,
    scan_curves,
)
from slipbench.identification.mismatch.curves.tooth_curve import discs, tooth_columns
from slipbench.identification.mismatch.curves.trace import simulated_responses
from slipbench.identification.mismatch.curves.whitened import Waveforms, Whitened
from slipbench.identification.mismatch.fit.held_out import CONFIRMED
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.stack import whiten_and_stack
from slipbench.identification.mismatch.fit.variance_inflation import SHARE, amplitude_p
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.regressor import TURN, kind_of
from slipbench.plant.signals import Floats


@dataclass(frozen=True)
class _Held:
    """What a curve does on held-out recordings: nats, nats if it were right, whitened course."""

    gain: float = 0.0
    worth: float = 0.0
    course: Floats | None = None


def locate(training: Linearization, held_out: Linearization | None) -> list[Curve]:
    """Fit every curve; the best first, by what both sets of recordings say together.

    The curves of one place are judged together, and their courses are not kept beyond that.
    """
    here = Whitened(training.fit)
    there = None if held_out is None else (held_out, Whitened(held_out.fit))
    batches = chain(scan_curves(training, here), around_turns(training, here), at_teeth(training))
    found = [curve for tries in batches for curve in _judged(training, there, tries)]
    over_all = [replace(c, p=min(1.0, c.p * len(found) / (1.0 - SHARE))) for c in found]
    return sorted(over_all, key=lambda c: (not c.certain, _doubt(c)))


def _judged(
    training: Linearization,
    held_out: tuple[Linearization, Whitened] | None,
    tries: list[CurveCandidate],
) -> Iterator[Curve]:
    """Yield the curves of one place; p as if each were the only one."""
    held = [_Held()] * len(tries) if held_out is None else _confirmed(*held_out, tries)
    for f, h in zip(tries, held, strict=True):
        p = _p(f, h, training, held_out[0] if held_out else None)
        yield Curve(
            f.place.name,
            f.place.block,
            f.place.unit,
            f.regressor,
            f.knots,
            f.place.size * f.values,
            f.log_likelihood_gain,
            h.gain,
            h.worth,
            p,
        )


def _p(
    found: CurveCandidate, held: _Held, training: Linearization, held_out: Linearization | None
) -> float:
    """p of what a curve foretells; 1 where it brings too little or held-out runs contradict it.

    Held-out recordings weigh as much as they would show of it.
    """
    if found.cross_predicted is None or (held.worth >= CONFIRMED > held.gain):
        return 1.0
    course, left, groups = found.cross_predicted, training.residuals, training.clusters
    if held_out is not None and held.course is not None:
        course = np.concatenate((course, held.course))
        left = np.concatenate((left, held_out.residuals))
        groups = np.concatenate((groups, held_out.clusters + 1 + groups.max()))
    least = found.place.negligible * found.place.size / found.half_range
    return amplitude_p(course, left, groups, training.fit.variance_inflation, least)


def _doubt(curve: Curve) -> float:
    """Order of curves: by their gain, held down by what the held-out recordings contradict."""
    if curve.tested < CONFIRMED:
        return -0.5 * curve.log_likelihood_gain
    return -min(curve.log_likelihood_gain, 3.0 * curve.confirmed + 1e-3 * curve.log_likelihood_gain)


def _confirmed(
    linear: Linearization, whitened: Whitened, tries: list[CurveCandidate]
) -> list[_Held]:
    """What the very same curves of one place do on other recordings."""
    known, columns = _columns(linear, whitened, tries)
    if not known:
        return [_Held()] * len(tries)
    energy, push = linear.energy_and_correlation(columns)
    held: dict[int, _Held] = {}
    for i, (number, e, along) in enumerate(zip(known, energy, push, strict=True)):
        course = None
        if tries[number].cross_predicted is not None:
            course = linear.nuisances.project_out(columns[:, i])
        held[number] = _Held(float(along - 0.5 * e), 0.5 * float(e), course)
    return [held.get(i, _Held()) for i in range(len(tries))]


def _columns(
    linear: Linearization, whitened: Whitened, tries: list[CurveCandidate]
) -> tuple[list[int], Floats]:
    """Return which curves can act on these recordings, and what each leaves in them, (rows, k)."""
    place = tries[0].place
    if kind_of(tries[0].regressor) == TURN and (place.inputs or place in _discs(linear)):
        found = _turning(linear, whitened, tries[0])
        return ([0], found[:, None]) if found is not None else ([], np.zeros((0, 0)))
    seen = whitened.seen_by(place.subsystem)
    known = [i for i, f in enumerate(tries) if f.regressor in seen[0][1]]
    knots = {tries[i].regressor: tries[i].knots for i in known}
    if not known:
        return [], np.zeros((0, 0))
    values = linalg.block_diag(*(place.size * tries[i].values[:, None] for i in known))
    pushes = Waveforms([tents @ values for tents in whitened.along(place.subsystem, knots).pushes])
    return known, whitened.columns(place, pushes)


def _discs(linear: Linearization) -> list[InjectionPoint]:
    return [place for place, _ in discs(linear.fit)]


def _turning(linear: Linearization, whitened: Whitened, found: CurveCandidate) -> Floats | None:
    """What a curve around a turn leaves, (rows,); None: there is no such angle."""
    fit, place = linear.fit, found.place
    if not place.inputs:
        teeth = whiten_and_stack(fit.model, fit.noise, tooth_columns(fit, place))
        return np.asarray(teeth @ found.values)
    seen = whitened.seen_by(place.subsystem)
    if found.regressor not in seen[0][1]:
        return None
    pushed = [place.size * found.values]
    turned = simulated_responses(fit, place, found.regressor, found.knots, pushed, seen)
    return whiten_and_stack(fit.model, fit.noise, turned)[:, 0]
