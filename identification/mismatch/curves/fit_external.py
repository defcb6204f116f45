"""External-input spline: a curve that the model does not contain, injected as an input.

Its regressor is re-evaluated until it is that of the simulation in which the curve acts.
"""

from collections.abc import Mapping
from dataclasses import replace

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.free_curve import FreeCurve
from slipbench.identification.mismatch.curves.injection import disturbance
from slipbench.identification.mismatch.curves.input_spline import InputSpline
from slipbench.identification.mismatch.curves.model_spline import injection_of
from slipbench.identification.mismatch.curves.trace import regressors
from slipbench.identification.mismatch.fit.fitting import Fit, renoised, with_effects
from slipbench.identification.mismatch.fit.held_out import refit_on
from slipbench.identification.mismatch.fit.optimize import at_fixed_noise, optimize
from slipbench.identification.mismatch.fit.refit import relinearized
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.input_disturbance import InputDisturbance
from slipbench.identification.mismatch.simulation.model import Model, predict
from slipbench.identification.mismatch.simulation.regressor import TURN, finer
from slipbench.identification.mismatch.thresholds import FURTHER_SHARE
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

ROUNDS = 6
PASSES = 3
"""Fixed-point iterations between an injected curve and its simulated regressor."""
SHARES = (1.0, 0.6, 0.3)
"""Candidate step fractions: a curve that changes its own regressor needs a damped step."""


def spline_in(base: Fit, curve: Curve) -> Fit | None:
    """Fit a curve as an input disturbance and update its regressor while that improves the fit.

    None where it does not improve the fit.
    """
    place = injection_of(base, curve)
    assert place is not None
    knots = curve.knots if curve.kind == TURN else finer(curve.regressor, curve.knots)
    spline = InputSpline.beside(base, place, curve.regressor, knots)
    best = base
    for _ in range(ROUNDS):
        try:
            refitted = renoised(at_fixed_noise(with_effects(best, (*base.candidates, spline)), 3))
            fits = [
                _consistent(refitted, spline.towards(injected_spline(refitted), share))
                for share in SHARES
            ]
        except PlantError:
            break
        fit = max(fits, key=lambda f: f.score)
        gained, before = fit.score - best.score, best.score - base.score
        if not gained > 0.0:
            break
        best = fit
        if gained < FURTHER_SHARE * before:
            break
        spline = injected_spline(best).refreshed(best)
    return best if best is not base else None


def _consistent(fit: Fit, spline: InputSpline) -> Fit:
    """Return the fit with a curve whose regressor is that of the simulation with the curve."""
    others = fit.candidates[:-1]
    for _ in range(PASSES):
        fit = with_effects(fit, (*others, spline))
        spline = spline.with_quantities_of(fit)
    return with_effects(fit, (*others, spline))


def injected_spline(fit: Fit) -> InputSpline:
    """Return the injected curve of a fit."""
    spline = fit.candidates[-1]
    assert isinstance(spline, InputSpline)
    return spline


def fix_external_spline(base: Fit, rough: Fit, held_out: Model | None) -> FreeCurve:
    """Fix the injected curve in the simulations of both sets and refit all other parameters."""
    spline = injected_spline(rough)
    place = spline.injection
    curve = Curve(
        place.name,
        place.block,
        place.unit,
        spline.regressor,
        spline.knots,
        spline.values,
        0.0,
        0.0,
        0.0,
    )
    fit = optimize(relinearized(_with_curve(base, rough, place, curve)))
    if held_out is None:
        return FreeCurve(curve, fit, fit.score - base.score, 0.0, None)
    confirmed, held_out_model = _confirmed(base, fit, place, curve, held_out)
    return FreeCurve(curve, fit, fit.score - base.score, confirmed, held_out_model)


def _confirmed(
    base: Fit, best: Fit, place: InjectionPoint, curve: Curve, held_out: Model
) -> tuple[float, Model]:
    """Return the gain of a curve on the held-out recordings, nats, and the held-out model with it.

    Its regressor there is updated with the curve acting, as often as in the fit.
    """
    before = refit_on(base, held_out)
    after = replace(refit_on(replace(best, model=base.model), held_out), candidates=())
    for _ in range(PASSES):
        after = optimize(_with_curve(before, after, place, curve))
    after = replace(after, candidates=best.candidates)
    return after.score - before.score, after.model


def _with_curve(base: Fit, at: Fit, place: InjectionPoint, curve: Curve) -> Fit:
    """Return the fit of `base` at the point of fit `at`, with the curve acting in its simulation.

    The regressor of the curve is that simulated by `at`.
    """
    existing = base.model.injected or ({},) * len(base.model.records)
    injected = tuple(
        _sum(before, injected_rows(at, r, place, curve)) for r, before in enumerate(existing)
    )
    model = replace(base.model, injected=injected)
    effects = tuple(e for e in at.point.effects if not isinstance(e, InputDisturbance))
    point = replace(at.point, effects=effects)
    kept = tuple(c for c in at.candidates if not isinstance(c, InputSpline))
    return replace(at, model=model, point=point, predicted=predict(model, point), candidates=kept)


def _sum(one: Mapping[str, Floats], other: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return both sets of columns, added where both contain a column."""
    return {**one, **{k: v + one[k] if k in one else v for k, v in other.items()}}


def injected_rows(fit: Fit, r: int, place: InjectionPoint, curve: Curve) -> Mapping[str, Floats]:
    """Return the disturbances of a curve in one record by name, SI, shape (rows,) each."""
    record = fit.model.records[r]
    waveform = regressors(fit, place.subsystem, r)[curve.regressor]
    return disturbance(fit.model.at(fit.point), place, record, curve(waveform, record.grid.step))
