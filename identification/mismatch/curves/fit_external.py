"""A curve that the simulation does not know: pushed as an input along its quantity.

The quantity is taken anew until it is that of the simulation in which the curve acts.
"""

from collections.abc import Mapping
from dataclasses import replace

from slipbench.identification.mismatch.curves.curve import Curve
from slipbench.identification.mismatch.curves.free_curve import FreeCurve
from slipbench.identification.mismatch.curves.input_spline import InputSpline
from slipbench.identification.mismatch.curves.model_spline import injection_of
from slipbench.identification.mismatch.curves.trace import regressors
from slipbench.identification.mismatch.fit.fitting import Fit, renoised, with_effects
from slipbench.identification.mismatch.fit.following import relinearized
from slipbench.identification.mismatch.fit.held_out import refit_on
from slipbench.identification.mismatch.fit.optimize import at_fixed_noise, optimize
from slipbench.identification.mismatch.simulation.injection_point import InjectionPoint
from slipbench.identification.mismatch.simulation.input_disturbance import InputDisturbance
from slipbench.identification.mismatch.simulation.model import Model, predict
from slipbench.identification.mismatch.simulation.regressor import TURN, finer
from slipbench.plant.errors import PlantError
from slipbench.plant.signals import Floats

ROUNDS = 6
PASSES = 3
"""How often a pushed curve's quantity is taken anew until it is that of its own simulation."""
SHARES = (1.0, 0.6, 0.3)
"""Of the way to what a fit asks for; a curve that changes its own quantity goes not all of it."""
FURTHER = 0.1
"""Share of what the first brings on the held-out recordings that another must bring there."""


def spline_in(base: Fit, curve: Curve) -> Fit | None:
    """Fit a curve as a course of pushes, its quantity taken anew as long as that helps much."""
    place = injection_of(base, curve)
    assert place is not None
    knots = curve.knots if curve.kind == TURN else finer(curve.regressor, curve.knots)
    pushed = InputSpline.beside(base, place, curve.regressor, knots)
    best = base
    for _ in range(ROUNDS):
        try:
            led = renoised(at_fixed_noise(with_effects(best, (*base.candidates, pushed)), 3))
            fits = [_consistent(led, pushed.towards(pushing(led), share)) for share in SHARES]
        except PlantError:
            break
        fit = max(fits, key=lambda f: f.score)
        gained, before = fit.score - best.score, best.score - base.score
        if not gained > 0.0:
            break
        best = fit
        if gained < FURTHER * before:
            break
        pushed = pushing(best).refreshed(best)
    return best if best is not base else None


def _consistent(fit: Fit, pushed: InputSpline) -> Fit:
    """Return the fit with a curve along what the simulation does when the curve acts in it."""
    others = fit.candidates[:-1]
    for _ in range(PASSES):
        fit = with_effects(fit, (*others, pushed))
        pushed = pushed.with_quantities_of(fit)
    return with_effects(fit, (*others, pushed))


def pushing(fit: Fit) -> InputSpline:
    """Return the curve that is pushed."""
    pushed = fit.candidates[-1]
    assert isinstance(pushed, InputSpline)
    return pushed


def standing(base: Fit, rough: Fit, held_out: Model | None) -> FreeCurve:
    """Let pushes stand in the simulation of both sets of recordings, and settle the rest."""
    pushed = pushing(rough)
    place = pushed.injection
    told = Curve(
        place.name,
        place.block,
        place.unit,
        pushed.regressor,
        pushed.knots,
        pushed.values,
        0.0,
        0.0,
        0.0,
        0.0,
    )
    fit = optimize(relinearized(_with(base, rough, place, told)))
    if held_out is None:
        return FreeCurve(told, fit, fit.score - base.score, 0.0, None)
    confirmed, proven = _confirmed(base, fit, place, told, held_out)
    return FreeCurve(told, fit, fit.score - base.score, confirmed, proven)


def _confirmed(
    base: Fit, best: Fit, place: InjectionPoint, curve: Curve, held_out: Model
) -> tuple[float, Model]:
    """Return what a curve gains on the held-out recordings, and the model in which it acts there.

    Its quantity there is taken anew with the curve acting, as often as it was in the fit.
    """
    before = refit_on(base, held_out)
    there = replace(refit_on(replace(best, model=base.model), held_out), candidates=())
    for _ in range(PASSES):
        there = optimize(_with(before, there, place, curve))
    there = replace(there, candidates=best.candidates)
    return there.score - before.score, there.model


def _with(base: Fit, at: Fit, place: InjectionPoint, curve: Curve) -> Fit:
    """Return the fit of `base` at the point of another with the curve acting in its simulation.

    The curve goes along what that other fit's simulation shows.
    """
    there = base.model.injected or ({},) * len(base.model.records)
    injected = tuple(
        _sum(before, injected_rows(at, r, place, curve)) for r, before in enumerate(there)
    )
    model = replace(base.model, injected=injected)
    effects = tuple(e for e in at.point.effects if not isinstance(e, InputDisturbance))
    point = replace(at.point, effects=effects)
    kept = tuple(c for c in at.candidates if not isinstance(c, InputSpline))
    return replace(at, model=model, point=point, predicted=predict(model, point), candidates=kept)


def _sum(one: Mapping[str, Floats], other: Mapping[str, Floats]) -> dict[str, Floats]:
    """Return both sets of columns, added where they share one."""
    return {**one, **{k: v + one[k] if k in one else v for k, v in other.items()}}


def injected_rows(fit: Fit, r: int, place: InjectionPoint, curve: Curve) -> dict[str, Floats]:
    """Return the inputs by which a curve acts, row by row."""
    record = fit.model.records[r]
    seen = regressors(fit, place.subsystem, r)[curve.regressor]
    return fit.model.at(fit.point).input_disturbance(place, record, curve(seen, record.grid.step))
