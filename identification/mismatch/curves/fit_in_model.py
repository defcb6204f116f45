"""Fit of a located free curve in the simulation, where no library effect explains the mismatch.

Where the model supports a free curve with this injection point and regressor, the curve is an
in-model spline: it is evaluated on the simulated regressor, so that its feedback is included, and
its values are fitted jointly with all uncertain parameters. Knots are moved to the largest
curvature. Otherwise the curve is an external-input spline over its regressor. The curve is then
tested on the held-out recordings.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.fit_external import fix_external_spline, spline_in
from slipbench.identification.mismatch.curves.free_curve import FreeCurve
from slipbench.identification.mismatch.curves.input_spline import InputSpline
from slipbench.identification.mismatch.curves.locate import locate
from slipbench.identification.mismatch.curves.model_spline import (
    injection_of,
    newest,
    refined_knots,
    simulable,
    simulated,
    with_many_knots,
)
from slipbench.identification.mismatch.curves.scan import enough
from slipbench.identification.mismatch.curves.trace import sensors_as_places
from slipbench.identification.mismatch.fit.calibrate import at_prior_mean, far_from_prior
from slipbench.identification.mismatch.fit.fitting import Fit
from slipbench.identification.mismatch.fit.held_out import refit_on
from slipbench.identification.mismatch.fit.linearization import Linearization
from slipbench.identification.mismatch.fit.optimize import optimize
from slipbench.identification.mismatch.fit.refit import refit_with_updated_jacobian, relinearized
from slipbench.identification.mismatch.simulation.model import Model
from slipbench.identification.mismatch.simulation.regressor import ROUNDS, TURN, even_angles
from slipbench.identification.mismatch.thresholds import CONFIRMED, FURTHER_SHARE
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

TRIED = 2
"""Located curves that are fitted in the simulation."""
AROUND = 5
"""Injection points at which a periodic curve of an angle is fitted."""
BENDS = 2
"""Number of knot refinements."""
MOST = 3
"""Largest number of curves fitted together."""


def fit_curves_in_model(
    base: Fit, curves: Sequence[Curve], held_out: Model | None, most: int = MOST
) -> FreeCurve | None:
    """Fit the best located curve in the simulation, and further curves that improve the fit.

    None where no curve can act in the simulation. most: largest number of curves.
    """
    found = _fit_one(base, curves, held_out)
    while found is not None and held_out is not None and len(found.beside) + 1 < most:
        model = found.proven
        assert model is not None
        located = locate(Linearization.of(found.fit), Linearization.of(refit_on(found.fit, model)))
        other = _fit_one(found.fit, [c for c in located if c.significant], model)
        if other is None or other.confirmed < max(CONFIRMED, FURTHER_SHARE * found.confirmed):
            break
        found = found.with_another(other)
    return found


def _fit_one(base: Fit, curves: Sequence[Curve], held_out: Model | None) -> FreeCurve | None:
    """Fit the best located curve beside the curves already in the fit."""
    rough = base.coarse
    chosen = _chosen(base, curves)
    candidates = [
        (start, fit)
        for start in _starts(rough)
        for curve in chosen
        for fit in _candidate_fits(start, curve)
    ]
    if not candidates:
        return None
    start, best = max(candidates, key=lambda t: t[1].score)
    if isinstance(best.candidates[-1], InputSpline):
        return fix_external_spline(base, best, held_out)
    periodic = newest(best).fitted_curve().kind == TURN
    for _ in range(0 if periodic else BENDS):
        refined = simulated(start, refined_knots(newest(best).fitted_curve()))
        if refined is None or refined.score < best.score:
            break
        best = refined
    best = best.fine(base.model)
    best = refit_with_updated_jacobian(best) if periodic else optimize(relinearized(best))
    confirmed = 0.0
    if held_out is not None:
        confirmed = refit_on(best, held_out).score - refit_on(base, held_out).score
    return FreeCurve(
        newest(best).fitted_curve(), best, best.score - base.score, confirmed, held_out
    )


def _starts(rough: Fit) -> Iterator[Fit]:
    """Yield the starting points: the fit itself and, if it is far from its prior, the prior mean.

    Parameters that compensate for a missing effect would otherwise keep their biased values.
    """
    yield rough
    if far_from_prior(rough):
        try:
            yield at_prior_mean(rough)
        except PlantError:
            return


def _chosen(base: Fit, curves: Sequence[Curve]) -> list[Curve]:
    """Return the first curves, and the first of each further kind at the first injection point.

    A curve of a sensor is one more: it is never the only candidate where others are significant. A periodic curve of an angle is located at the teeth of a wheel first; a torque on the wheel is
    an alternative.
    """
    injectable = [c for c in curves if injection_of(base, c) is not None]
    if curves and curves[0].significant and curves[0].kind == TURN:
        turning = [c for c in injectable if c.kind == TURN]
        if turning:
            return turning[:AROUND]
    significant = [c for c in injectable if c.significant]
    if not significant:
        return injectable[:1]
    sensors = {p.name for p in sensors_as_places(base)}
    physical = [c for c in significant if c.place not in sensors]
    of_sensors = [c for c in significant if c.place in sensors]
    same_point = [c for c in physical if c.place == physical[0].place]
    first_of_kind = {c.kind: c for c in reversed(same_point)}
    chosen = (*physical[:TRIED], *first_of_kind.values(), *of_sensors[:1])
    return list({id(c): c for c in chosen}.values())


def _candidate_fits(rough: Fit, curve: Curve) -> Iterator[Fit]:
    if not simulable(rough, curve):
        fit = spline_in(rough, curve)
    elif curve.kind == TURN:
        fit = _fit_periodic(rough, curve)
    else:
        fit = _with_knots(rough, curve, with_many_knots(curve.knots))
    if fit is not None:
        yield fit


def _fit_periodic(rough: Fit, curve: Curve) -> Fit | None:
    """Fit a periodic curve of an angle; orders are added while the gain justifies the knots."""
    best, count = None, 0
    for knot_count in ROUNDS:
        fit = _with_knots(rough, curve, even_angles(knot_count))
        if fit is None or (best and fit.score - best.score < enough(knot_count - count)):
            break
        best, count = fit, knot_count
    return best


def _with_knots(rough: Fit, curve: Curve, knots: Floats) -> Fit | None:
    return simulated(rough, replace(curve, knots=knots, values=curve(knots)))
