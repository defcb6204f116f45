"""None of the above: a located curve is put into the simulation itself and fitted there.

The curve acts at its place as an input of the simulation, evaluated along its recorded regressor.
It gets a knot more between each two, and its values are corrected by what it still leaves while the
vehicle is fitted around it; then the same curve meets the held-out recordings.
"""

from dataclasses import dataclass, replace

import numpy as np

from identification.mismatch.fitting import Fit, settle
from identification.mismatch.held_out import carried_over
from identification.mismatch.injection import places
from identification.mismatch.locate import Curve, locate_along, regressors
from identification.mismatch.model import Model, predict
from identification.mismatch.place import Injection
from identification.mismatch.score import Judge
from plant.signals import Floats

ROUNDS = 4


@dataclass(frozen=True, eq=False)
class FreeCurve:
    """A curve inside the simulation. gain, confirmed: nats on training and held-out runs."""

    curve: Curve
    fit: Fit
    gain: float
    confirmed: float


def inside(base: Fit, curve: Curve, held_out: Model | None) -> FreeCurve | None:
    """Put a curve into the simulation; None for a sensor's curve, which nothing is driven by."""
    place = next((p for p in places(base) if p.name == curve.place), None)
    if place is None:
        return None
    best, kept = base, replace(_finer(curve), values=np.zeros(2 * curve.knots.size - 1))
    share = 1.0
    for _ in range(ROUNDS):
        more = locate_along(Judge.of(best), place, kept.regressor, kept.knots)
        now = replace(kept, values=kept.values + share * more)
        fit = settle(_with(base, best, place, now))
        if fit.score > best.score:
            best, kept = fit, now
        else:
            share *= 0.4
    confirmed = _confirmed(base, best, place, kept, held_out) if held_out is not None else 0.0
    return FreeCurve(kept, best, best.score - base.score, confirmed)


def _finer(curve: Curve) -> Curve:
    """Return the curve with a knot more between each two."""
    knots = np.sort(np.concatenate((curve.knots, 0.5 * (curve.knots[1:] + curve.knots[:-1]))))
    return replace(curve, knots=knots, values=curve(knots))


def _with(base: Fit, at: Fit, place: Injection, curve: Curve) -> Fit:
    """Return the fit with the curve acting in its simulation."""
    injected = tuple(injected_rows(base, r, place, curve) for r in range(len(base.model.records)))
    model = replace(base.model, injected=injected)
    new = replace(at, model=model, predicted=predict(model, at.point))
    new.__dict__["nuisances"] = at.nuisances
    return new


def injected_rows(fit: Fit, r: int, place: Injection, curve: Curve) -> dict[str, Floats]:
    """Return the inputs by which a curve acts, row by row."""
    record = fit.model.records[r]
    course = curve(regressors(fit, place.drive, r)[curve.regressor])
    rows = np.interp(record.time, record.grid.centre, course)
    return fit.model.at(fit.point).push(place, record, rows)


def _confirmed(base: Fit, best: Fit, place: Injection, curve: Curve, held_out: Model) -> float:
    before = carried_over(base, held_out)
    after = carried_over(replace(best, candidates=base.candidates), held_out)
    with_it = settle(_with(before, after, place, curve), noises=2)
    return with_it.score - before.score
